#include "repair/orient_closed.h"
// Based on: the propagation of orientation over edges is folklore; the nesting by parity of the
// crossings of a ray follows F. S. Nooruddin, G. Turk, Simplification and Repair of Polygonal
// Models Using Volumetric Techniques, 2003.

#include "base/disjoint_sets.h"
#include "mesh/border.h"
#include "mesh/edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace gewebe::repair {
namespace {

bool balanced(const mesh::EdgeSides& edges) {
  bool all = true;
  edges.for_each_edge([&](std::uint32_t, std::span<const mesh::EdgeSide> edge) {
    all = all && mesh::surplus(edge) == 0;
  });
  return all;
}

/// Which triangles to flip so that neighbours over edges of two triangles agree; empty where that
/// cannot be.
std::vector<char> agreeing_flips(const mesh::EdgeSides& edges, std::size_t triangles) {
  constexpr std::uint32_t none = UINT32_MAX;
  // Per triangle up to three neighbours: 2 t, and 1 more where one of the two must be flipped.
  std::vector<std::array<std::uint32_t, 3>> neighbours(triangles, {none, none, none});
  const auto link = [&](const mesh::EdgeSide& a, const mesh::EdgeSide& b) {
    auto& list = neighbours[a.face()];
    *std::find(list.begin(), list.end() - 1, none) =
        2 * b.face() + (a.backward() == b.backward() ? 1 : 0);
  };
  edges.for_each_edge([&](std::uint32_t, std::span<const mesh::EdgeSide> edge) {
    if (edge.size() == 2) {
      link(edge[0], edge[1]);
      link(edge[1], edge[0]);
    }
  });
  constexpr char unknown = 2;
  std::vector<char> flip(triangles, unknown);
  std::vector<std::uint32_t> queue;
  for (std::size_t seed = 0; seed < triangles; ++seed) {
    if (flip[seed] != unknown)
      continue;
    flip[seed] = 0;
    queue.assign(1, static_cast<std::uint32_t>(seed));
    while (!queue.empty()) {
      const std::uint32_t t = queue.back();
      queue.pop_back();
      for (const std::uint32_t neighbour : neighbours[t]) {
        if (neighbour == none)
          break;
        const auto wanted = static_cast<char>(flip[t] ^ static_cast<char>(neighbour & 1));
        char& there = flip[neighbour >> 1];
        if (there == unknown) {
          there = wanted;
          queue.push_back(neighbour >> 1);
        } else if (there != wanted) {
          return {};
        }
      }
    }
  }
  return flip;
}

/// Triangles by cells of the (x, y) plane, for rays along z.
class Columns {
public:
  Columns(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles)
      : points_(points), triangles_(triangles) {
    for (const Triangle& t : triangles)
      for (const std::uint32_t corner : t)
        box_.add(points[corner]);
    cells_ = static_cast<std::size_t>(
        std::clamp(std::sqrt(static_cast<double>(triangles.size())), 1.0, 2048.0));
    first_.assign(cells_ * cells_ + 1, 0);
    for_each_cell([&](std::size_t cell, std::uint32_t) { ++first_[cell + 1]; });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    members_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for_each_cell([&](std::size_t cell, std::uint32_t n) { members_[next[cell]++] = n; });
  }

  /// Is the number of faces of parts other than `own` below p odd?
  bool odd_below(const Vec3& p, const std::vector<std::uint32_t>& part, std::uint32_t own) const {
    const std::size_t cell = cell_of(p.x, 0) * cells_ + cell_of(p.y, 1);
    bool odd = false;
    for (std::size_t m = first_[cell]; m < first_[cell + 1]; ++m)
      if (part[members_[m]] != own && below(triangles_[members_[m]], p))
        odd = !odd;
    return odd;
  }

private:
  std::size_t cell_of(double x, int axis) const {
    const double size = box_.max[axis] - box_.min[axis];
    const double cell = size > 0 ? (x - box_.min[axis]) / size * static_cast<double>(cells_) : 0;
    return std::min(static_cast<std::size_t>(std::fmax(cell, 0)), cells_ - 1);
  }
  template <class Visit>
  void for_each_cell(Visit&& visit) const {
    for (std::size_t n = 0; n < triangles_.size(); ++n) {
      Box3 box;
      for (const std::uint32_t corner : triangles_[n])
        box.add(points_[corner]);
      for (std::size_t i = cell_of(box.min.x, 0); i <= cell_of(box.max.x, 0); ++i)
        for (std::size_t j = cell_of(box.min.y, 1); j <= cell_of(box.max.y, 1); ++j)
          visit(i * cells_ + j, static_cast<std::uint32_t>(n));
    }
  }
  bool below(const Triangle& t, const Vec3& p) const {
    bool in = false;
    for (std::size_t c = 0; c < 3; ++c) {
      Vec3 a = points_[t[c]], b = points_[t[c == 2 ? 0 : c + 1]];
      if ((a.x > p.x) == (b.x > p.x))
        continue;
      if (a.x > b.x)
        std::swap(a, b); // so that triangles that share the edge agree
      in ^= a.y + (p.x - a.x) / (b.x - a.x) * (b.y - a.y) > p.y;
    }
    if (!in)
      return false;
    const Vec3& a = points_[t[0]];
    const Vec3 normal = cross(points_[t[1]] - a, points_[t[2]] - a);
    return (dot(p - a, normal) > 0) == (normal.z > 0);
  }

  const std::vector<Vec3>& points_;
  const std::vector<Triangle>& triangles_;
  Box3 box_;
  std::size_t cells_ = 1;
  std::vector<std::size_t> first_;
  std::vector<std::uint32_t> members_;
};

/// Flips parts as the header says.
void turn_parts(const std::vector<Vec3>& points, const std::vector<std::uint32_t>& part,
                std::uint32_t parts, std::vector<Triangle>& triangles) {
  std::vector<double> volume(parts, 0);
  std::vector<std::size_t> first(std::size_t{parts} + 1, 0);
  std::vector<Vec3> origin(parts);
  for (std::size_t n = 0; n < triangles.size(); ++n) {
    const Triangle& t = triangles[n];
    Vec3& o = origin[part[n]];
    if (first[part[n] + 1]++ == 0)
      o = points[t[0]];
    volume[part[n]] += dot(points[t[0]] - o, cross(points[t[1]] - o, points[t[2]] - o));
  }
  std::vector<char> flip(parts, 0);
  if (parts == 1) {
    flip[0] = volume[0] < 0;
  } else {
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::uint32_t> members(triangles.size());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t n = 0; n < triangles.size(); ++n)
      members[next[part[n]]++] = n;
    const Columns columns(points, triangles);
    for (std::uint32_t c = 0; c < parts; ++c) {
      // Points a little inside the part, since its surface may be that of a part beside it; of
      // several, since parts may cut each other.
      int votes = 0;
      constexpr std::size_t asked = 9;
      for (std::size_t v = 0; v < asked; ++v) {
        const Triangle& t = triangles[members[first[c] + v * (first[c + 1] - first[c]) / asked]];
        const Vec3 &p0 = points[t[0]], &p1 = points[t[1]], &p2 = points[t[2]];
        const Vec3 normal = cross(p1 - p0, p2 - p0); // its length is that of an area
        const double size = std::sqrt(norm(normal));
        const double inward = size > 0 ? (volume[c] < 0 ? 1e-4 : -1e-4) / size : 0;
        const Vec3 p = p0 * 0.375 + p1 * 0.3125 + p2 * 0.3125 + normal * inward;
        votes += columns.odd_below(p, part, c) ? 1 : -1;
      }
      flip[c] = (volume[c] < 0) != (votes > 0);
    }
  }
  if (std::ranges::all_of(flip, [](char f) { return f == 0; }))
    return;
  for (std::size_t n = 0; n < triangles.size(); ++n)
    if (flip[part[n]] != 0)
      std::swap(triangles[n][1], triangles[n][2]);
}

} // namespace

bool orient_closed(const std::vector<Vec3>& points, std::vector<Triangle>& triangles,
                   OrientReport* report) {
  DisjointSets sets(triangles.size());
  std::vector<Triangle> turned = triangles;
  if (!mesh::join_opposite_sides(points.size(), triangles, sets)) {
    sets = DisjointSets(triangles.size());
    std::vector<Triangle> welded = triangles;
    const std::vector<std::uint32_t> representative = mesh::first_at_position(points);
    for (Triangle& t : welded)
      for (std::uint32_t& corner : t)
        corner = representative[corner];
    mesh::EdgeSides edges(points.size(), welded);
    if (!balanced(edges)) {
      const std::vector<char> flip = agreeing_flips(edges, triangles.size());
      for (std::size_t n = 0; n < flip.size(); ++n)
        if (flip[n] != 0) {
          std::swap(turned[n][1], turned[n][2]);
          std::swap(welded[n][1], welded[n][2]);
        }
      edges = mesh::EdgeSides(points.size(), welded);
      if (flip.empty() || !balanced(edges))
        return false;
    }
    edges.for_each_edge([&](std::uint32_t, std::span<const mesh::EdgeSide> edge) {
      for (const mesh::EdgeSide& side : edge)
        sets.join(edge[0].face(), side.face());
    });
  }
  std::vector<std::uint32_t> part;
  const std::uint32_t parts = sets.number(part);
  turn_parts(points, part, parts, turned);
  if (report != nullptr) {
    report->parts = parts;
    report->flipped = 0;
    for (std::size_t n = 0; n < triangles.size(); ++n)
      report->flipped += turned[n] != triangles[n];
  }
  triangles = std::move(turned);
  return true;
}

} // namespace gewebe::repair
