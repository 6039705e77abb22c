#include "volume/oriented_surface.h"

#include "volume/mesh_border.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

namespace gewebe {
namespace {

/// A side of a triangle; sides of one edge stand together when sorted.
struct Side {
  std::int32_t part;
  std::uint32_t low, high;
  std::uint32_t triangle;
  bool upward; ///< the triangle runs from low to high

  auto edge() const { return std::tie(part, low, high); }
};

std::vector<Side> sorted_sides(std::span<const Triangle> triangles,
                               std::span<const std::int32_t> part) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (std::size_t n = 0; n < triangles.size(); ++n)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t from = triangles[n][c], to = triangles[n][c == 2 ? 0 : c + 1];
      sides.push_back({part.empty() ? 0 : part[n], std::min(from, to), std::max(from, to),
                       static_cast<std::uint32_t>(n), from < to});
    }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.part, a.low, a.high, a.triangle) <
           std::tie(b.part, b.low, b.high, b.triangle);
  });
  return sides;
}

/// Calls visit with the span of sides of each edge.
template <class Visit>
void for_each_edge(std::span<const Side> sides, Visit&& visit) {
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].edge() == sides[begin].edge())
      ++end;
    visit(sides.subspan(begin, end - begin));
  }
}

class Groups {
public:
  explicit Groups(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  std::uint32_t of(std::uint32_t n) {
    while (parent_[n] != n)
      n = parent_[n] = parent_[parent_[n]];
    return n;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t x = of(a), y = of(b);
    parent_[std::max(x, y)] = std::min(x, y);
  }

private:
  std::vector<std::uint32_t> parent_;
};

/// Takes degenerate and repeated triangles out; `part` follows.
void drop_repeated(OrientedSurface& surface, std::vector<std::int32_t>& part) {
  std::vector<std::tuple<std::int32_t, Triangle, std::uint32_t>> keys;
  for (std::size_t n = 0; n < surface.triangles.size(); ++n) {
    Triangle t = surface.triangles[n];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0])
      continue;
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    keys.emplace_back(part.empty() ? 0 : part[n], t, static_cast<std::uint32_t>(n));
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> keep;
  for (std::size_t n = 0; n < keys.size(); ++n)
    if (n > 0 && std::get<0>(keys[n]) == std::get<0>(keys[n - 1]) &&
        std::get<1>(keys[n]) == std::get<1>(keys[n - 1]))
      ++surface.triangles_duplicate;
    else
      keep.push_back(std::get<2>(keys[n]));
  std::sort(keep.begin(), keep.end());
  for (std::size_t n = 0; n < keep.size(); ++n) {
    surface.triangles[n] = surface.triangles[keep[n]];
    if (!part.empty())
      part[n] = part[keep[n]];
  }
  surface.triangles.resize(keep.size());
  if (!part.empty())
    part.resize(keep.size());
}

/// Makes the triangles of each patch agree with most of its area.
void agree(std::span<const Vec3> points, std::span<const Side> sides, OrientedSurface& surface) {
  struct Neighbour {
    std::uint32_t triangle;
    bool against;
  };
  std::vector<std::array<Neighbour, 3>> neighbours(surface.triangles.size());
  std::vector<std::uint8_t> count(surface.triangles.size(), 0);
  for_each_edge(sides, [&](std::span<const Side> edge) {
    if (edge.size() != 2)
      return;
    const bool against = edge[0].upward == edge[1].upward;
    neighbours[edge[0].triangle][count[edge[0].triangle]++] = {edge[1].triangle, against};
    neighbours[edge[1].triangle][count[edge[1].triangle]++] = {edge[0].triangle, against};
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
void turn_outward(std::span<const Vec3> points, std::span<const Side> sides,
                  OrientedSurface& surface) {
  Groups groups(surface.triangles.size());
  for_each_edge(sides, [&](std::span<const Side> edge) {
    for (const Side& side : edge)
      groups.join(edge[0].triangle, side.triangle);
  });
  struct Sum {
    Vec3 middle;
    double corners = 0, volume = 0;
  };
  std::vector<Sum> sums(surface.triangles.size());
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    Sum& sum = sums[groups.of(t)];
    for (const std::uint32_t corner : surface.triangles[t])
      sum.middle += points[corner];
    sum.corners += 3;
  }
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    Sum& sum = sums[groups.of(t)];
    const Vec3 middle = sum.middle / sum.corners;
    const auto& [a, b, c] = surface.triangles[t];
    sum.volume += dot(points[a] - middle, cross(points[b] - middle, points[c] - middle));
  }
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    const Sum& sum = sums[groups.of(t)];
    if (groups.of(t) == t) {
      ++surface.parts;
      surface.parts_turned += sum.volume < 0 ? 1 : 0;
    }
    if (sum.volume < 0)
      std::swap(surface.triangles[t][1], surface.triangles[t][2]);
  }
}

} // namespace

OrientedSurface orient_surface(std::span<const Vec3> points, std::span<const Triangle> triangles,
                               std::span<const std::int32_t> part) {
  OrientedSurface surface;
  surface.triangles.assign(triangles.begin(), triangles.end());
  std::vector<std::int32_t> parts(part.begin(), part.end());
  const std::vector<std::uint32_t> first = first_at_position(points);
  for (Triangle& t : surface.triangles)
    for (std::uint32_t& corner : t)
      corner = first[corner];
  drop_repeated(surface, parts);
  agree(points, sorted_sides(surface.triangles, parts), surface);
  turn_outward(points, sorted_sides(surface.triangles, parts), surface);
  return surface;
}

std::vector<Triangle> closing_cones(std::vector<Vec3>& points,
                                    std::span<const Triangle> triangles) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<int> surplus; // how often more up than down
  const std::vector<Side> sides = sorted_sides(triangles, {});
  for_each_edge(sides, [&](std::span<const Side> edge) {
    int up = 0;
    for (const Side& side : edge)
      up += side.upward ? 1 : -1;
    if (up != 0) {
      edges.push_back({edge[0].low, edge[0].high});
      surplus.push_back(up);
    }
  });
  std::vector<std::uint32_t> group;
  const std::uint32_t groups = edge_groups(edges, group);
  struct Hole {
    Vec3 sum;
    double ends = 0;
    Box3 box;
  };
  std::vector<Hole> holes(groups);
  for (std::size_t e = 0; e < edges.size(); ++e)
    for (const std::uint32_t end : edges[e]) {
      Hole& hole = holes[group[e]];
      hole.sum += points[end];
      hole.ends += 1;
      hole.box.add(points[end]);
    }
  const auto first_apex = static_cast<std::uint32_t>(points.size());
  // Off the mean, lest the inner edges of a cone run through sample points.
  for (const Hole& hole : holes)
    points.push_back(hole.sum / hole.ends +
                     Vec3{0.013717, 0.007129, 0.011317} * hole.box.longest_side());
  std::vector<Triangle> cones;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto [low, high] = edges[e];
    const std::uint32_t apex = first_apex + group[e];
    for (int n = 0; n < std::abs(surplus[e]); ++n)
      cones.push_back(surplus[e] > 0 ? Triangle{high, low, apex} : Triangle{low, high, apex});
  }
  return cones;
}

} // namespace gewebe
