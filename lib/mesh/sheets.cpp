#include "mesh/sheets.h"

#include "base/disjoint_sets.h"
#include "mesh/edges.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace gewebe::mesh {

namespace {

constexpr std::uint32_t none = UINT32_MAX;

/// By corner, the corner opposite to the same edge in the one other face there, or none.
std::vector<std::uint32_t> corners_across(std::size_t points, std::span<const Triangle> triangles) {
  std::vector<std::uint32_t> across(3 * triangles.size(), none);
  EdgeSides(points, triangles).for_each_edge([&](std::uint32_t, std::span<const EdgeSide> edge) {
    if (edge.size() != 2)
      return;
    across[edge[0].corner()] = edge[1].corner();
    across[edge[1].corner()] = edge[0].corner();
  });
  return across;
}

std::uint32_t point_at(std::span<const Triangle> triangles, std::uint32_t corner) {
  return triangles[corner / 3][corner % 3];
}

/// Which faces are to be turned. Where that fails the way across is closed.
std::vector<char> agree(std::span<const Triangle> triangles, std::vector<std::uint32_t>& across) {
  std::vector<char> backward(triangles.size(), 0), seen(triangles.size(), 0);
  std::vector<std::uint32_t> stack;
  for (std::uint32_t first = 0; first < triangles.size(); ++first) {
    if (seen[first] != 0)
      continue;
    seen[first] = 1;
    stack.push_back(first);
    while (!stack.empty()) {
      const std::uint32_t face = stack.back();
      stack.pop_back();
      // The edges in the order in which the face, turned, runs along them.
      const std::array<std::uint32_t, 3> opposite = backward[face] != 0
                                                        ? std::array<std::uint32_t, 3>{0, 2, 1}
                                                        : std::array<std::uint32_t, 3>{2, 0, 1};
      for (const std::uint32_t k : opposite) {
        const std::uint32_t corner = 3 * face + k, other = across[corner];
        if (other == none)
          continue;
        const bool same_way =
            point_at(triangles, next_corner(corner)) == point_at(triangles, next_corner(other));
        const std::uint32_t neighbour = other / 3;
        const char wanted = static_cast<char>(same_way ? backward[face] ^ 1 : backward[face]);
        if (seen[neighbour] == 0) {
          seen[neighbour] = 1;
          backward[neighbour] = wanted;
          stack.push_back(neighbour);
        } else if (backward[neighbour] != wanted) {
          across[corner] = across[other] = none;
        }
      }
    }
  }
  return backward;
}

} // namespace

Sheets cut_into_sheets(std::size_t points, std::span<const Triangle> triangles) {
  std::vector<std::uint32_t> across = corners_across(points, triangles);
  Sheets sheets;
  sheets.backward = agree(triangles, across);

  // Corners that are one point: those on both sides of an open way, at both ends.
  DisjointSets sets(across.size());
  for (std::uint32_t corner = 0; corner < across.size(); ++corner) {
    const std::uint32_t other = across[corner];
    if (other == none || other < corner)
      continue;
    std::uint32_t a = next_corner(other), b = previous_corner(other);
    if (point_at(triangles, next_corner(corner)) != point_at(triangles, a))
      std::swap(a, b);
    sets.join(next_corner(corner), a);
    sets.join(previous_corner(corner), b);
  }

  // The group with the first face keeps the point; copies are numbered by point, then group.
  std::vector<std::uint32_t> group_of(points, none), copied;
  std::vector<std::uint32_t> point_of(across.size(), none);
  for (std::uint32_t corner = 0; corner < across.size(); ++corner) {
    if (sets.find(corner) != corner)
      continue;
    const std::uint32_t point = point_at(triangles, corner);
    if (group_of[point] == none) {
      group_of[point] = corner;
      point_of[corner] = point;
    } else {
      copied.push_back(corner);
    }
  }
  std::stable_sort(copied.begin(), copied.end(), [&](std::uint32_t a, std::uint32_t b) {
    return point_at(triangles, a) < point_at(triangles, b);
  });
  sheets.origin.resize(points);
  std::iota(sheets.origin.begin(), sheets.origin.end(), 0U);
  for (const std::uint32_t corner : copied) {
    point_of[corner] = static_cast<std::uint32_t>(sheets.origin.size());
    sheets.origin.push_back(point_at(triangles, corner));
  }
  sheets.triangles.resize(triangles.size());
  for (std::uint32_t corner = 0; corner < across.size(); ++corner) {
    const std::uint32_t face = corner / 3, k = corner % 3;
    sheets.triangles[face][sheets.backward[face] != 0 ? 2 - k : k] = point_of[sets.find(corner)];
  }
  return sheets;
}

HalfEdges half_edges(std::size_t points, std::span<const Triangle> triangles) {
  const std::vector<std::uint32_t> across = corners_across(points, triangles);
  HalfEdges out;
  out.of_point.assign(points, none);
  std::vector<std::uint32_t> at_corner(across.size()); // the half-edge of the face opposite to it
  for (std::uint32_t face = 0; face < triangles.size(); ++face) {
    const Triangle& t = triangles[face];
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t corner = 3 * face + (k + 2) % 3, other = across[corner];
      if (other != none && other < 3 * face) {
        at_corner[corner] = at_corner[other] ^ 1U;
        out.face[at_corner[corner]] = face;
        continue;
      }
      at_corner[corner] = static_cast<std::uint32_t>(out.target.size());
      out.target.insert(out.target.end(), {t[(k + 1) % 3], t[k]});
      out.face.insert(out.face.end(), {face, none});
    }
    out.of_face.push_back(at_corner[3 * face + 1]); // it joins the last corner to the first
  }

  out.next.assign(out.target.size(), none);
  for (std::uint32_t corner = 0; corner < across.size(); ++corner)
    out.next[at_corner[corner]] = at_corner[next_corner(corner)];
  std::vector<std::uint32_t> out_of(points, none); // the half-edge of the border that starts there
  for (std::uint32_t h = 0; h < out.target.size(); ++h)
    if (out.face[h] == none)
      out_of[out.target[h ^ 1U]] = h;
  for (std::uint32_t corner = 0; corner < across.size(); ++corner)
    out.of_point[point_at(triangles, previous_corner(corner))] = at_corner[corner];
  for (std::uint32_t h = 0; h < out.target.size(); ++h)
    if (out.face[h] == none) {
      out.next[h] = out_of[out.target[h]];
      out.of_point[out.target[h]] = h;
    }
  return out;
}

} // namespace gewebe::mesh
