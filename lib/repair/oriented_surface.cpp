#include "repair/oriented_surface.h"

#include "base/disjoint_sets.h"
#include "mesh/border.h"
#include "mesh/edges.h"
#include "mesh/repeated_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>

namespace gewebe::repair {
namespace {

using Part = std::span<const std::int32_t>;

/// Calls visit(faces at it) for each edge; faces of different parts have no edge in common.
template <class Visit>
void for_each_edge(const mesh::EdgeSides& sides, Part part, const Visit& visit) {
  std::vector<mesh::EdgeSide> sorted;
  sides.for_each_edge([&](std::uint32_t, std::span<const mesh::EdgeSide> edge) {
    const auto part_of = [&](const mesh::EdgeSide& side) { return part[side.face()]; };
    if (part.empty() || std::ranges::all_of(edge, [&](const mesh::EdgeSide& side) {
          return part_of(side) == part_of(edge[0]);
        })) {
      visit(edge);
      return;
    }
    sorted.assign(edge.begin(), edge.end());
    std::ranges::stable_sort(sorted, {}, part_of);
    for (std::size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
      while (end < sorted.size() && part_of(sorted[end]) == part_of(sorted[begin]))
        ++end;
      visit(std::span<const mesh::EdgeSide>(sorted).subspan(begin, end - begin));
    }
  });
}

/// Takes degenerate and repeated triangles out; `part` follows.
void drop_repeated(std::size_t points, OrientedSurface& surface, std::vector<std::int32_t>& part) {
  std::vector<Triangle>& faces = surface.triangles;
  const auto keep_only = [&](const auto& keeps) {
    std::size_t kept = 0;
    for (std::size_t n = 0; n < faces.size(); ++n) {
      if (!keeps(n))
        continue;
      faces[kept] = faces[n];
      surface.source[kept] = surface.source[n];
      if (!part.empty())
        part[kept] = part[n];
      ++kept;
    }
    faces.resize(kept);
    surface.source.resize(kept);
    part.resize(part.empty() ? 0 : kept);
  };
  surface.source.resize(faces.size());
  std::iota(surface.source.begin(), surface.source.end(), 0U);
  keep_only([&](std::size_t n) { return !mesh::has_equal_corners(faces[n]); });
  const std::vector<bool> repeated =
      mesh::repeated_faces(points, faces, mesh::SameFace::orientation, part);
  surface.triangles_duplicate = static_cast<std::uint64_t>(std::ranges::count(repeated, true));
  if (surface.triangles_duplicate > 0)
    keep_only([&](std::size_t n) { return !repeated[n]; });
}

/// Makes the triangles of each patch agree with most of its area.
void agree(std::span<const Vec3> points, Part part, OrientedSurface& surface) {
  struct Neighbour {
    std::uint32_t triangle;
    bool against;
  };
  std::vector<std::array<Neighbour, 3>> neighbours(surface.triangles.size());
  std::vector<std::uint8_t> count(surface.triangles.size(), 0);
  const mesh::EdgeSides sides(points.size(), surface.triangles);
  for_each_edge(sides, part, [&](std::span<const mesh::EdgeSide> edge) {
    if (edge.size() != 2)
      return;
    const std::uint32_t a = edge[0].face(), b = edge[1].face();
    const bool against = edge[0].backward() == edge[1].backward();
    neighbours[a][count[a]++] = {b, against};
    neighbours[b][count[b]++] = {a, against};
  });
  std::vector<bool> seen(surface.triangles.size(), false), turned(surface.triangles.size(), false);
  std::vector<std::uint32_t> patch;
  for (std::uint32_t seed = 0; seed < surface.triangles.size(); ++seed) {
    if (seen[seed])
      continue;
    seen[seed] = true;
    patch.assign(1, seed);
    double area[2] = {0, 0};
    for (std::size_t n = 0; n < patch.size(); ++n) {
      const std::uint32_t t = patch[n];
      const auto& [a, b, c] = surface.triangles[t];
      area[turned[t] ? 1 : 0] += norm(cross(points[b] - points[a], points[c] - points[a]));
      for (std::uint8_t m = 0; m < count[t]; ++m) {
        const Neighbour next = neighbours[t][m];
        if (seen[next.triangle])
          continue;
        seen[next.triangle] = true;
        turned[next.triangle] = turned[t] != next.against;
        patch.push_back(next.triangle);
      }
    }
    for (const std::uint32_t t : patch)
      if (turned[t] != (area[1] > area[0])) {
        std::swap(surface.triangles[t][1], surface.triangles[t][2]);
        ++surface.triangles_turned;
      }
  }
}

/// Turns the parts of negative volume.
void turn_outward(std::span<const Vec3> points, Part part, OrientedSurface& surface) {
  DisjointSets groups(surface.triangles.size());
  struct Sum {
    Vec3 middle;
    double corners = 0, area = 0, volume = 0;
    bool open = false;
    bool inward() const { // a ball's volume is area^1.5 / (6 sqrt(pi))
      return volume < (open ? -0.01 * area * std::sqrt(area) / 10.634723105433096 : 0);
    }
  };
  std::vector<Sum> sums(surface.triangles.size());
  const mesh::EdgeSides sides(points.size(), surface.triangles);
  std::vector<std::uint32_t> open; // a face of each edge that is
  for_each_edge(sides, part, [&](std::span<const mesh::EdgeSide> edge) {
    for (const mesh::EdgeSide& side : edge)
      groups.join(edge[0].face(), side.face());
    if (mesh::surplus(edge) != 0)
      open.push_back(edge[0].face());
  });
  for (const std::uint32_t t : open)
    sums[groups.find(t)].open = true;
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    Sum& sum = sums[groups.find(t)];
    for (const std::uint32_t corner : surface.triangles[t])
      sum.middle += points[corner];
    sum.corners += 3;
  }
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    Sum& sum = sums[groups.find(t)];
    const Vec3 middle = sum.middle / sum.corners;
    const auto& [a, b, c] = surface.triangles[t];
    sum.volume += dot(points[a] - middle, cross(points[b] - middle, points[c] - middle)) / 6;
    sum.area += norm(cross(points[b] - points[a], points[c] - points[a])) / 2;
  }
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    const Sum& sum = sums[groups.find(t)];
    if (groups.find(t) == t) {
      ++surface.parts;
      surface.parts_turned += sum.inward() ? 1 : 0;
    }
    if (sum.inward())
      std::swap(surface.triangles[t][1], surface.triangles[t][2]);
  }
}

/// Divides directed edges, with as many ends as beginnings in each point, into loops that meet no
/// point twice. Walks on until a point comes again, and prefers to close the shortest loop it can.
std::vector<std::vector<std::uint32_t>> loops_of(std::vector<std::array<std::uint32_t, 2>> edges) {
  std::sort(edges.begin(), edges.end());
  constexpr std::uint32_t none = UINT32_MAX;
  std::vector<bool> used(edges.size(), false);
  const auto first_from = [&](std::uint32_t point) {
    return static_cast<std::size_t>(
        std::lower_bound(edges.begin(), edges.end(), std::array<std::uint32_t, 2>{point, 0}) -
        edges.begin());
  };
  std::vector<std::vector<std::uint32_t>> loops;
  std::unordered_map<std::uint32_t, std::uint32_t> place; // in the walk
  std::vector<std::uint32_t> walk;
  for (std::size_t start = 0; start < edges.size(); ++start) {
    if (used[start])
      continue;
    walk.assign(1, edges[start][0]);
    place.clear();
    place[walk[0]] = 0;
    while (!walk.empty()) {
      std::size_t best = edges.size();
      std::uint32_t best_place = none;
      for (std::size_t e = first_from(walk.back()); e < edges.size() && edges[e][0] == walk.back();
           ++e) {
        if (used[e])
          continue;
        const auto at = place.find(edges[e][1]);
        const std::uint32_t there = at == place.end() ? none : at->second;
        if (best == edges.size() || (there != none && (best_place == none || there > best_place))) {
          best = e;
          best_place = there;
        }
      }
      if (best == edges.size())
        break; // back at the start, and nothing left there
      used[best] = true;
      if (best_place == none) {
        place[edges[best][1]] = static_cast<std::uint32_t>(walk.size());
        walk.push_back(edges[best][1]);
        continue;
      }
      loops.emplace_back(walk.begin() + best_place, walk.end());
      while (walk.size() > best_place + 1) {
        place.erase(walk.back());
        walk.pop_back();
      }
    }
  }
  return loops;
}

/// The cone of a loop; the pieces are in rings about as wide as the loop's edges are long.
void add_cone(std::vector<Vec3>& points, const std::vector<std::uint32_t>& loop, const Vec3& tip,
              ClosingCones& result) {
  const std::size_t size = loop.size();
  const auto apex = static_cast<std::uint32_t>(points.size());
  points.push_back(tip);
  for (std::size_t n = 0; n < size; ++n)
    result.cones.push_back({loop[n], loop[(n + 1) % size], apex});
  double around = 0, across = 0;
  for (std::size_t n = 0; n < size; ++n) {
    around += norm(points[loop[(n + 1) % size]] - points[loop[n]]);
    across += norm(tip - points[loop[n]]);
  }
  const auto rings = static_cast<std::size_t>(std::clamp(across / around, 1.0, 64.0));
  std::vector<std::uint32_t> outer = loop;
  for (std::size_t ring = 1; ring < rings; ++ring) {
    const double t = static_cast<double>(ring) / static_cast<double>(rings);
    std::vector<std::uint32_t> inner(size);
    for (std::size_t n = 0; n < size; ++n) {
      const Vec3 corner = points[loop[n]];
      inner[n] = static_cast<std::uint32_t>(points.size());
      points.push_back(corner + t * (tip - corner));
    }
    for (std::size_t n = 0; n < size; ++n) {
      const std::size_t next = (n + 1) % size;
      result.pieces.push_back({outer[n], outer[next], inner[next]});
      result.pieces.push_back({outer[n], inner[next], inner[n]});
    }
    outer = std::move(inner);
  }
  for (std::size_t n = 0; n < size; ++n)
    result.pieces.push_back({outer[n], outer[(n + 1) % size], apex});
}

} // namespace

OrientedSurface orient_surface(std::span<const Vec3> points, std::span<const Triangle> triangles,
                               std::span<const std::int32_t> part) {
  OrientedSurface surface;
  surface.triangles.assign(triangles.begin(), triangles.end());
  std::vector<std::int32_t> parts(part.begin(), part.end());
  const std::vector<std::uint32_t> first = mesh::first_at_position(points);
  for (Triangle& t : surface.triangles)
    for (std::uint32_t& corner : t)
      corner = first[corner];
  drop_repeated(points.size(), surface, parts);
  agree(points, parts, surface);
  turn_outward(points, parts, surface);
  return surface;
}

ClosingCones closing_cones(std::vector<Vec3>& points, std::span<const Triangle> triangles) {
  std::vector<std::array<std::uint32_t, 2>> missing; // from, to: what would balance the edges
  mesh::EdgeSides(points.size(), triangles)
      .for_each_edge([&](std::uint32_t low, std::span<const mesh::EdgeSide> edge) {
        int up = mesh::surplus(edge);
        for (; up > 0; --up)
          missing.push_back({edge[0].high(), low});
        for (; up < 0; ++up)
          missing.push_back({low, edge[0].high()});
      });
  ClosingCones result;
  for (const std::vector<std::uint32_t>& loop : loops_of(std::move(missing))) {
    if (loop.size() == 3) {
      result.cones.push_back({loop[0], loop[1], loop[2]});
      result.pieces.push_back(result.cones.back());
      continue;
    }
    Vec3 sum;
    Box3 box;
    for (const std::uint32_t corner : loop) {
      sum += points[corner];
      box.add(points[corner]);
    }
    // Off the mean, lest the inner edges of a cone run through sample points.
    const Vec3 tip = sum / static_cast<double>(loop.size()) +
                     Vec3{0.013717, 0.007129, 0.011317} * box.longest_side();
    add_cone(points, loop, tip, result);
  }
  return result;
}

} // namespace gewebe::repair
