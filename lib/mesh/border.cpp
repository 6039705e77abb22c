#include "mesh/border.h"

#include "base/disjoint_sets.h"
#include "mesh/edges.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <tuple>

namespace gewebe::mesh {
namespace {

using Edge = std::array<std::uint32_t, 2>;

/// Edges with an odd number of triangles by index alone.
std::vector<Edge> odd_by_index(std::size_t points, std::span<const Triangle> triangles) {
  std::vector<Edge> odd;
  EdgeSides(points, triangles)
      .for_each_edge([&](std::uint32_t low, std::span<const EdgeSide> edge) {
        if (edge.size() % 2 != 0)
          odd.push_back({low, edge[0].high()});
      });
  return odd;
}

/// Pairs the sides of faces in one pass, without a sort. At the smaller end of its edge each waits
/// as item(face, from, to) for the first that is its partner; then visit(both). False if a side
/// stays alone or more than eight wait at a point.
template <class Item, class MakeItem, class Partners, class Visit>
bool pair_sides(std::size_t points, std::span<const Triangle> triangles, const MakeItem& make_item,
                const Partners& partners, const Visit& visit) {
  constexpr std::uint32_t places = 8;
  struct Waiting {
    std::uint32_t count = 0;
    std::array<Item, places> items;
  };
  std::vector<Waiting> waiting(points);
  std::size_t alone = 0;
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const Triangle& t = triangles[f];
    if (has_equal_corners(t))
      continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t from = t[c], to = t[c == 2 ? 0 : c + 1];
      const Item item = make_item(f, from, to);
      Waiting& at = waiting[std::min(from, to)];
      std::uint32_t w = 0;
      while (w < at.count && !partners(at.items[w], item))
        ++w;
      if (w < at.count) {
        visit(at.items[w], item);
        at.items[w] = at.items[--at.count];
        --alone;
      } else {
        if (w == places)
          return false;
        at.items[at.count++] = item;
        ++alone;
      }
    }
  }
  return alone == 0;
}

} // namespace

std::vector<std::uint32_t> first_at_position(std::span<const Vec3> points) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const Vec3 &p = points[a], &q = points[b];
    return std::tie(p.x, p.y, p.z, a) < std::tie(q.x, q.y, q.z, b);
  });
  std::vector<std::uint32_t> representative(points.size());
  for (std::size_t n = 0; n < order.size(); ++n) {
    const bool same = n > 0 && points[order[n]] == points[order[n - 1]];
    representative[order[n]] = same ? representative[order[n - 1]] : order[n];
  }
  return representative;
}

bool closed_by_index(std::size_t points, std::span<const Triangle> triangles) {
  const auto item = [](std::uint32_t, std::uint32_t from, std::uint32_t to) {
    return std::max(from, to);
  };
  return pair_sides<std::uint32_t>(points, triangles, item, std::equal_to<>(),
                                   [](std::uint32_t, std::uint32_t) {});
}

bool join_opposite_sides(std::size_t points, std::span<const Triangle> triangles,
                         DisjointSets& faces) {
  struct Side {
    std::uint32_t high;
    std::uint32_t run; ///< 2 face, and 1 more where the face runs from the larger point
  };
  const auto item = [](std::uint32_t face, std::uint32_t from, std::uint32_t to) {
    return Side{std::max(from, to), 2 * face | (from > to ? 1U : 0U)};
  };
  const auto partners = [](const Side& a, const Side& b) {
    return a.high == b.high && ((a.run ^ b.run) & 1) != 0;
  };
  return pair_sides<Side>(points, triangles, item, partners, [&](const Side& a, const Side& b) {
    faces.join(a.run >> 1, b.run >> 1);
  });
}

std::vector<std::uint32_t> border_points(std::size_t points, std::span<const Triangle> triangles) {
  std::vector<char> ends_open_edge(points, 0);
  EdgeSides(points, triangles)
      .for_each_edge([&](std::uint32_t low, std::span<const EdgeSide> edge) {
        if (edge.size() == 1)
          ends_open_edge[low] = ends_open_edge[edge[0].high()] = 1;
      });
  std::vector<std::uint32_t> border;
  for (std::uint32_t p = 0; p < points; ++p)
    if (ends_open_edge[p] != 0)
      border.push_back(p);
  return border;
}

std::vector<Edge> odd_edges(std::span<const Vec3> points, std::span<const Triangle> triangles) {
  std::vector<Edge> odd = odd_by_index(points.size(), triangles);
  if (odd.empty())
    return odd; // closed by index is closed by position
  const std::vector<std::uint32_t> representative = first_at_position(points);
  std::vector<Triangle> welded(triangles.begin(), triangles.end());
  for (Triangle& t : welded)
    for (std::uint32_t& corner : t)
      corner = representative[corner];
  return odd_by_index(points.size(), welded);
}

std::uint32_t edge_groups(const std::vector<Edge>& edges, std::vector<std::uint32_t>& group) {
  std::vector<std::uint32_t> ends;
  for (const Edge& e : edges)
    ends.insert(ends.end(), e.begin(), e.end());
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  const auto local = [&](std::uint32_t point) {
    return static_cast<std::uint32_t>(std::lower_bound(ends.begin(), ends.end(), point) -
                                      ends.begin());
  };
  DisjointSets sets(ends.size());
  for (const Edge& e : edges)
    sets.join(local(e[0]), local(e[1]));

  constexpr std::uint32_t none = UINT32_MAX;
  std::vector<std::uint32_t> number(ends.size(), none);
  std::uint32_t groups = 0;
  group.resize(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    std::uint32_t& n = number[sets.find(local(edges[e][0]))];
    if (n == none)
      n = groups++;
    group[e] = n;
  }
  return groups;
}

void close_with_cones(const std::vector<Edge>& edges, std::vector<Vec3>& points,
                      std::vector<Triangle>& triangles) {
  std::vector<std::uint32_t> group;
  const std::uint32_t groups = edge_groups(edges, group);
  const auto first_apex = static_cast<std::uint32_t>(points.size());
  std::vector<double> ends(groups, 0);
  points.resize(points.size() + groups);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    points[first_apex + group[e]] += points[edges[e][0]] + points[edges[e][1]];
    ends[group[e]] += 2;
  }
  for (std::uint32_t g = 0; g < groups; ++g)
    points[first_apex + g] *= 1 / ends[g];
  for (std::size_t e = 0; e < edges.size(); ++e)
    triangles.push_back({edges[e][0], edges[e][1], first_apex + group[e]});
}

} // namespace gewebe::mesh
