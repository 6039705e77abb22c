#pragma once
// What contact with instruments has to meet, by distances of triangles.

#include "collision/candidates.h"
#include "collision/distance.h"
#include "contact/instrument.h"
#include "contact/island.h"
#include "larger.h"
#include "model/model.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::test {

/// Part of its radius by which a node may be inside an instrument: 0.6 d_hat, where d_hat is at
/// most 1e-3 radii.
inline constexpr double depth_allowed = 6.01e-4;

/// Smallest distance of two collision surfaces at x, without their radii; below 0 where an edge of
/// one meets a triangle of the other. Primitives that share a vertex do not count.
/// \param allowed  by owners
inline double surface_distance(const collision::CollisionSurface& surface, std::span<const Vec3> x,
                               const collision::AllowedPairs& allowed) {
  collision::BroadPhase search(surface);
  collision::Candidates near;
  Box3 box;
  for (const Vec3& p : x)
    box.add(p);
  // Farther and farther, until something is as near as was looked.
  for (double reach = 1e-3 * box.longest_side();; reach *= 4) {
    search.find(surface, x, x, reach, allowed, near);
    double least = HUGE_VAL;
    const auto look = [&](const auto& pair, auto&& squared) {
      std::array<gewebe::Vec3, std::tuple_size_v<std::decay_t<decltype(pair)>>> corners;
      for (std::size_t k = 0; k < corners.size(); ++k)
        corners[k] = x[pair[k]];
      least = smaller(least, squared(corners));
    };
    for (const auto& p : near.point_point)
      look(p, [](const auto& c) { return gewebe::dot(c[0] - c[1], c[0] - c[1]); });
    for (const auto& p : near.point_edge)
      look(p, [](const auto& c) { return collision::point_edge_squared_distance(c); });
    for (const auto& p : near.edge_edge)
      look(p, [](const auto& c) { return collision::edge_edge_squared_distance(c); });
    for (const auto& p : near.point_triangle)
      look(p, [](const auto& c) { return collision::point_triangle_squared_distance(c); });
    least = std::sqrt(least);
    if (least > reach && reach < 4 * box.longest_side())
      continue;
    return search.find_intersections(surface, x, allowed, 1).empty() ? least : -1;
  }
}

/// Appends a surface as one more owner. \param x  positions of its vertices
inline void add_surface(collision::CollisionSurface& all, std::vector<Vec3>& places,
                        const contact::BodySurface& one, std::span<const Vec3> x,
                        std::uint32_t owner) {
  const auto first = static_cast<std::uint32_t>(all.rest.size());
  all.rest.insert(all.rest.end(), one.rest.begin(), one.rest.end());
  places.insert(places.end(), x.begin(), x.end());
  all.owner.resize(all.rest.size(), owner);
  all.radius.resize(all.rest.size(), 0);
  for (const auto& [a, b, c] : one.triangles)
    all.triangles.push_back({a + first, b + first, c + first});
  for (const auto& [a, b] : one.edges)
    all.edges.push_back({a + first, b + first});
  for (const std::uint32_t p : one.points)
    all.points.push_back(p + first);
}

/// How deep the surface between nodes that can move is in an instrument, over its radius; below 0
/// where it isn't. \param u 3 n displacements
inline double surface_depth(const model::Model& model, std::span<const double> u,
                            const contact::InstrumentShape& shape, const contact::Pose& pose) {
  contact::BodySurface tissue;
  std::vector<Vec3> x;
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    tissue.rest.push_back(model.nodes[i].position);
    x.push_back(model.nodes[i].position + Vec3{u[3 * i], u[3 * i + 1], u[3 * i + 2]});
  }
  for (const Triangle& t : model.triangles)
    if (model.nodes[t[0]].fixed == model::fixed_none &&
        model.nodes[t[1]].fixed == model::fixed_none &&
        model.nodes[t[2]].fixed == model::fixed_none)
      tissue.triangles.push_back({t[0], t[1], t[2]});
  const contact::BodySurface tool = contact::instrument_surface(shape);
  std::vector<Vec3> corners;
  for (const Vec3& c : tool.rest)
    corners.push_back(pose(c));
  collision::CollisionSurface all;
  std::vector<Vec3> places;
  add_surface(all, places, tissue, x, 0);
  add_surface(all, places, tool, corners, 1);
  collision::complete_surface(all);
  collision::AllowedPairs allowed(2, 0);
  allowed.set(0, 1, 1);
  return 1 - surface_distance(all, places, allowed) / shape.radius;
}

} // namespace gewebe::test
