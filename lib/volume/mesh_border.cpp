#include "volume/mesh_border.h"

#include "base/disjoint_sets.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace gewebe {
namespace {

using Edge = std::array<std::uint32_t, 2>;

/// Edges with an odd number of triangles by index alone.
std::vector<Edge> odd_by_index(std::size_t points, std::span<const Triangle> triangles) {
  // The larger ends of all edges, in one bucket per smaller end.
  std::vector<std::size_t> first(points + 1, 0);
  const auto for_each_edge = [&](auto&& visit) {
    for (const Triangle& t : triangles)
      for (std::size_t c = 0; c < 3; ++c) {
        const auto [low, high] = std::minmax(t[c], t[c == 2 ? 0 : c + 1]);
        if (low != high)
          visit(low, high);
      }
  };
  for_each_edge([&](std::uint32_t low, std::uint32_t) { ++first[low + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::uint32_t> ends(first.back());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for_each_edge([&](std::uint32_t low, std::uint32_t high) { ends[next[low]++] = high; });

  std::vector<Edge> odd;
  for (std::size_t p = 0; p < points; ++p) {
    const auto begin = ends.begin() + static_cast<std::ptrdiff_t>(first[p]);
    const auto end = ends.begin() + static_cast<std::ptrdiff_t>(first[p + 1]);
    std::sort(begin, end);
    for (auto e = begin; e != end;) {
      const auto run_end = std::find_if(e, end, [&](std::uint32_t high) { return high != *e; });
      if ((run_end - e) % 2 != 0)
        odd.push_back({static_cast<std::uint32_t>(p), *e});
      e = run_end;
    }
  }
  return odd;
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
  // Per point the larger ends of edges that were met an odd number of times so far.
  constexpr std::size_t places = 8;
  constexpr std::uint32_t none = UINT32_MAX;
  struct Waiting {
    std::array<std::uint32_t, places> end;
  };
  Waiting empty{};
  empty.end.fill(none);
  std::vector<Waiting> waiting(points, empty);
  std::size_t count = 0;
  for (const Triangle& t : triangles)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t from = t[c], to = t[c == 2 ? 0 : c + 1];
      const std::uint32_t low = std::min(from, to), high = std::max(from, to);
      if (low == high)
        continue;
      // The ends stand before the first `none`.
      std::array<std::uint32_t, places>& ends = waiting[low].end;
      std::size_t n = 0;
      while (n < places && ends[n] != high && ends[n] != none)
        ++n;
      if (n == places)
        return false;
      if (ends[n] == none) {
        ends[n] = high;
        ++count;
        continue;
      }
      std::size_t last = n;
      while (last + 1 < places && ends[last + 1] != none)
        ++last;
      ends[n] = ends[last];
      ends[last] = none;
      --count;
    }
  return count == 0;
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

} // namespace gewebe
