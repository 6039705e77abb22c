#include "collision/candidates.h"

#include "collision/distance.h"
#include "collision/edge_triangle.h"
#include "collision/pair_feature.h"
#include "geometry/boxes_meet.h"
#include "numeric/larger.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <type_traits>

namespace gewebe::collision {

namespace {

/// Lists of fewer primitives have no groups; primitives of a group.
constexpr std::size_t many = 1024, group_size = 64;
/// The whole tree serves where more than this part of a list is near.
constexpr double few = 0.25;
/// Lists of fewer are compared with all of another one.
constexpr std::size_t very_few = 8;

template <std::size_t n>
std::array<Vec3, n> positions(std::span<const Vec3> x, const std::array<std::uint32_t, n>& vertex) {
  std::array<Vec3, n> y;
  for (std::size_t k = 0; k < n; ++k)
    y[k] = x[vertex[k]];
  return y;
}

Box3 inflated(Box3 box, double by) {
  box.min -= Vec3{by, by, by};
  box.max += Vec3{by, by, by};
  return box;
}

} // namespace

BroadPhase::BroadPhase(const CollisionSurface& surface) {
  for (const std::uint32_t owner : surface.owner)
    owners_.resize(std::max<std::size_t>(owners_.size(), owner + std::size_t{1}));
  const auto owner_of = [&](std::uint32_t vertex) -> Owner& {
    return owners_[surface.owner[vertex]];
  };
  for (const std::uint32_t p : surface.points)
    owner_of(p).points.number.push_back(p);
  for (const std::uint32_t p : surface.lone_points)
    owner_of(p).lone_points.number.push_back(p);
  for (const std::uint32_t e : surface.lone_edges)
    owner_of(surface.edges[e][0]).lone_edges.number.push_back(e);
  for (std::uint32_t e = 0; e < surface.edges.size(); ++e)
    owner_of(surface.edges[e][0]).edges.number.push_back(e);
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t)
    owner_of(surface.triangles[t][0]).triangles.number.push_back(t);
}

template <class BoxOf>
void BroadPhase::set_boxes(const BoxOf& box_of) {
  for (Owner& owner : owners_) {
    owner.box = {};
    for (const std::uint32_t p : owner.points.number) {
      const Box3 box = box_of(std::array{p});
      owner.box.add(box.min);
      owner.box.add(box.max);
    }
    for (Primitives* primitives :
         {&owner.points, &owner.edges, &owner.triangles, &owner.lone_points, &owner.lone_edges})
      primitives->current = primitives->grouped_now = false;
  }
}

template <class BoxOf, class VerticesOf>
void BroadPhase::refit(Primitives& primitives, const BoxOf& box_of, const VerticesOf& vertices_of) {
  if (primitives.current)
    return;
  primitives.current = true;
  primitives.boxes.resize(primitives.number.size());
  for (std::size_t k = 0; k < primitives.number.size(); ++k)
    primitives.boxes[k] = box_of(vertices_of(primitives.number[k]));
  if (primitives.tree.size() != primitives.number.size())
    primitives.tree = Bvh(primitives.boxes);
  else
    primitives.tree.refit(primitives.boxes);
}

void BroadPhase::find_pairs(const Primitives& a, const Primitives& b) {
  pairs_.clear();
  const auto add = [&](std::uint32_t i, std::uint32_t j) {
    pairs_.push_back({a.number[i], b.number[j]});
  };
  if (&a == &b)
    a.tree.for_each_own_pair(add);
  else
    a.tree.for_each_pair(b.tree, add);
  std::sort(pairs_.begin(), pairs_.end());
}

template <class VerticesOf>
void BroadPhase::make_groups(std::span<const Vec3> x, Primitives& primitives,
                             const VerticesOf& vertices_of) {
  std::vector<Box3> boxes(primitives.number.size());
  for (std::size_t k = 0; k < boxes.size(); ++k)
    for (const std::uint32_t v : vertices_of(primitives.number[k]))
      boxes[k].add(x[v]);
  Bvh(boxes, group_size).for_each_leaf([&](std::span<const std::uint32_t> places) {
    Group group;
    group.first = static_cast<std::uint32_t>(primitives.grouped.size());
    primitives.grouped.insert(primitives.grouped.end(), places.begin(), places.end());
    group.last = static_cast<std::uint32_t>(primitives.grouped.size());
    std::vector<std::uint32_t> corners;
    for (const std::uint32_t place : places)
      for (const std::uint32_t v : vertices_of(primitives.number[place]))
        corners.push_back(v);
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    group.first_corner = static_cast<std::uint32_t>(primitives.corners.size());
    primitives.corners.insert(primitives.corners.end(), corners.begin(), corners.end());
    group.last_corner = static_cast<std::uint32_t>(primitives.corners.size());
    primitives.groups.push_back(group);
  });
}

template <class BoxOf, class VerticesOf>
bool BroadPhase::find_near(Primitives& primitives, const Box3& other, std::span<const Vec3> x,
                           const BoxOf& box_of, const VerticesOf& vertices_of, Near& near) {
  near.place.clear();
  near.boxes.clear();
  const auto look = [&](std::uint32_t place) {
    const Box3 box = box_of(vertices_of(primitives.number[place]));
    if (!meet(box, other))
      return;
    near.place.push_back(place);
    near.boxes.push_back(box);
  };
  const std::size_t count = primitives.number.size();
  if (count < many) {
    for (std::uint32_t place = 0; place < count; ++place)
      look(place);
    return true;
  }
  if (primitives.groups.empty())
    make_groups(x, primitives, vertices_of);
  if (!primitives.grouped_now)
    for (Group& group : primitives.groups)
      group.box = box_of(std::span(primitives.corners)
                             .subspan(group.first_corner, group.last_corner - group.first_corner));
  primitives.grouped_now = true;
  std::size_t close = 0;
  for (const Group& group : primitives.groups)
    if (meet(group.box, other))
      close += group.last - group.first;
  if (!(static_cast<double>(close) <= few * static_cast<double>(count)))
    return false;
  for (const Group& group : primitives.groups)
    if (meet(group.box, other))
      for (std::uint32_t k = group.first; k < group.last; ++k)
        look(primitives.grouped[k]);
  return true;
}

void BroadPhase::find_near_pairs(const Primitives& a, const Primitives& b) {
  pairs_.clear();
  const auto& [near_a, near_b] = near_;
  const auto add = [&, &of_a = near_a.place, &of_b = near_b.place](std::size_t i, std::size_t j) {
    pairs_.push_back({a.number[of_a[i]], b.number[of_b[j]]});
  };
  const std::size_t count_a = near_a.place.size(), count_b = near_b.place.size();
  if (std::min(count_a, count_b) > very_few) {
    Bvh(near_a.boxes).for_each_pair(Bvh(near_b.boxes), add);
  } else {
    for (std::size_t i = 0; i < count_a; ++i)
      for (std::size_t j = 0; j < count_b; ++j)
        if (meet(near_a.boxes[i], near_b.boxes[j]))
          add(i, j);
  }
  std::sort(pairs_.begin(), pairs_.end());
}

void BroadPhase::find(const CollisionSurface& surface, std::span<const Vec3> x0,
                      std::span<const Vec3> x1, double reach, const AllowedPairs& allowed,
                      Candidates& candidates) {
  candidates.clear();
  const auto point = [](std::uint32_t p) { return std::array{p}; };
  const auto edge = [&](std::uint32_t e) { return surface.edges[e]; };
  const auto triangle = [&](std::uint32_t t) { return surface.triangles[t]; };
  // Boxes of the swept vertices, each with half of the reach and its radius around it.
  const auto box_of = [&](const auto& vertices) {
    Box3 box;
    for (const std::uint32_t v : vertices) {
      box.add(x0[v]);
      box.add(x1[v]);
    }
    return inflated(box, 0.5 * reach + surface.radius[vertices[0]]);
  };
  set_boxes(box_of);

  std::array<std::vector<double>, 4> gaps;
  const auto add = [&](const auto& first, const auto& second, auto& list, auto& gaps_of_list) {
    constexpr std::size_t k = std::tuple_size_v<std::remove_cvref_t<decltype(first)>>;
    constexpr std::size_t n = k + std::tuple_size_v<std::remove_cvref_t<decltype(second)>>;
    std::array<std::uint32_t, n> vertices;
    std::copy(first.begin(), first.end(), vertices.begin());
    std::copy(second.begin(), second.end(), vertices.begin() + k);
    bool fixed = true;
    for (std::size_t i = 0; i < n; ++i)
      fixed = fixed && surface.is_fixed(vertices[i]);
    if (fixed)
      return;
    for (std::size_t i = 0; i < k; ++i)
      for (std::size_t j = k; j < n; ++j)
        if (vertices[i] == vertices[j] ||
            surface.is_held(vertices[i], surface.owner[vertices[j]]) ||
            surface.is_held(vertices[j], surface.owner[vertices[i]]))
          return;
    const auto from = positions(x0, vertices), to = positions(x1, vertices);
    const double gap = std::sqrt(squared_distance(closest_feature(from, k), from)) -
                       radius_sum(surface, vertices[0], vertices[n - 1]);
    if (gap > reach + motion_bound(from, to, k))
      return; // NaN stays
    list.push_back(vertices);
    gaps_of_list.push_back(gap);
  };
  // Of two owners, or of one and itself.
  const auto meet_all = [&](Primitives& a, const auto& vertices_a, const Owner& of_a, Primitives& b,
                            const auto& vertices_b, const Owner& of_b, auto& list,
                            std::vector<double>& gaps_of_list) {
    if (a.number.empty() || b.number.empty())
      return;
    if (&of_a != &of_b && std::max(a.number.size(), b.number.size()) >= many &&
        find_near(a, of_b.box, x0, box_of, vertices_a, near_[0]) &&
        find_near(b, of_a.box, x0, box_of, vertices_b, near_[1])) {
      find_near_pairs(a, b);
    } else {
      refit(a, box_of, vertices_a);
      refit(b, box_of, vertices_b);
      find_pairs(a, b);
    }
    for (const auto& [i, j] : pairs_)
      add(vertices_a(i), vertices_b(j), list, gaps_of_list);
  };
  const std::size_t owners = std::min(owners_.size(), allowed.owners());
  for (std::size_t i = 0; i < owners; ++i)
    for (std::size_t j = i; j < owners; ++j) {
      Owner &a = owners_[i], &b = owners_[j];
      if (!allowed.at(i, j) || !meet(a.box, b.box))
        continue;
      meet_all(a.points, point, a, b.triangles, triangle, b, candidates.point_triangle, gaps[3]);
      if (i != j)
        meet_all(b.points, point, b, a.triangles, triangle, a, candidates.point_triangle, gaps[3]);
      meet_all(a.edges, edge, a, b.edges, edge, b, candidates.edge_edge, gaps[2]);
      meet_all(a.lone_points, point, a, b.lone_edges, edge, b, candidates.point_edge, gaps[1]);
      if (i != j)
        meet_all(b.lone_points, point, b, a.lone_edges, edge, a, candidates.point_edge, gaps[1]);
      meet_all(a.lone_points, point, a, b.lone_points, point, b, candidates.point_point, gaps[0]);
    }
  gaps_.clear();
  for (const std::vector<double>& of_list : gaps)
    gaps_.insert(gaps_.end(), of_list.begin(), of_list.end());
}

std::vector<Intersection> BroadPhase::find_intersections(const CollisionSurface& surface,
                                                         std::span<const Vec3> x,
                                                         const AllowedPairs& allowed,
                                                         std::size_t most) {
  const auto edge = [&](std::uint32_t e) { return surface.edges[e]; };
  const auto triangle = [&](std::uint32_t t) { return surface.triangles[t]; };
  const auto box_of = [&](const auto& vertices) {
    Box3 box;
    for (const std::uint32_t v : vertices)
      box.add(x[v]);
    return box;
  };
  set_boxes(box_of);
  std::vector<Intersection> found;
  const auto meet_all = [&](Primitives& edges, Primitives& triangles) {
    if (edges.number.empty() || triangles.number.empty())
      return;
    refit(edges, box_of, edge);
    refit(triangles, box_of, triangle);
    find_pairs(edges, triangles);
    for (const auto& [e, t] : pairs_) {
      const auto [p, q] = edge(e);
      const auto [a, b, c] = triangle(t);
      if (found.size() >= most)
        return;
      if (p == a || p == b || p == c || q == a || q == b || q == c || surface.radius[p] > 0 ||
          surface.radius[a] > 0)
        continue;
      if (edge_meets_triangle(x[p], x[q], x[a], x[b], x[c]))
        found.push_back({e, t});
    }
  };
  const std::size_t owners = std::min(owners_.size(), allowed.owners());
  for (std::size_t i = 0; i < owners; ++i)
    for (std::size_t j = i; j < owners; ++j) {
      if (!allowed.at(i, j) || !meet(owners_[i].box, owners_[j].box))
        continue;
      meet_all(owners_[i].edges, owners_[j].triangles);
      if (i != j)
        meet_all(owners_[j].edges, owners_[i].triangles);
    }
  return found;
}

std::vector<std::uint32_t> vertices_of(const Candidates& candidates) {
  std::vector<std::uint32_t> vertices;
  const auto add = [&](const auto& list) {
    for (const auto& pair : list)
      vertices.insert(vertices.end(), pair.begin(), pair.end());
  };
  add(candidates.point_point);
  add(candidates.point_edge);
  add(candidates.edge_edge);
  add(candidates.point_triangle);
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

template <std::size_t n>
double collision_free_step(const CollisionSurface& surface,
                           const std::array<std::uint32_t, n>& vertices, std::size_t first,
                           std::span<const gewebe::Vec3> x0, std::span<const gewebe::Vec3> x1,
                           const Separation& separation, double t_max) {
  Separation of_pair = separation;
  of_pair.d_min += radius_sum(surface, vertices.front(), vertices.back());
  const auto from = positions(x0, vertices), to = positions(x1, vertices);
  if constexpr (n == 2)
    return point_point_step(from, to, of_pair, t_max);
  else if constexpr (n == 3)
    return point_edge_step(from, to, of_pair, t_max);
  else
    return first == 2 ? edge_edge_step(from, to, of_pair, t_max)
                      : point_triangle_step(from, to, of_pair, t_max);
}

template double collision_free_step(const CollisionSurface&, const std::array<std::uint32_t, 2>&,
                                    std::size_t, std::span<const Vec3>, std::span<const Vec3>,
                                    const Separation&, double);
template double collision_free_step(const CollisionSurface&, const std::array<std::uint32_t, 3>&,
                                    std::size_t, std::span<const Vec3>, std::span<const Vec3>,
                                    const Separation&, double);
template double collision_free_step(const CollisionSurface&, const std::array<std::uint32_t, 4>&,
                                    std::size_t, std::span<const Vec3>, std::span<const Vec3>,
                                    const Separation&, double);

double collision_free_step(const CollisionSurface& surface, const Candidates& candidates,
                           std::span<const Vec3> x0, std::span<const Vec3> x1,
                           const Separation& separation, double t_max) {
  double step = t_max;
  const auto shorten = [&](const auto& list, std::size_t first) {
    for (const auto& vertices : list)
      step = collision_free_step(surface, vertices, first, x0, x1, separation, step);
  };
  shorten(candidates.point_point, 1);
  shorten(candidates.point_edge, 1);
  shorten(candidates.edge_edge, 2);
  shorten(candidates.point_triangle, 1);
  return step;
}

} // namespace gewebe::collision
