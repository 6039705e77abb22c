#pragma once
// Borders of triangle meshes: edges of one triangle, and, as the parity rule sees them, edges with
// an odd number of triangles. By index unless stated otherwise.

#include "base/disjoint_sets.h"
#include "geometry/mesh.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::mesh {

/// Edges in which an odd number of triangles meet, each {smaller, larger} point index, ascending.
/// Points at equal position count as one (the smallest index stands for them). Empty: every ray in
/// general position crosses the mesh an even number of times.
std::vector<std::array<std::uint32_t, 2>> odd_edges(std::span<const Vec3> points,
                                                    std::span<const Triangle> triangles);

/// True only if every edge has an even number of triangles by index alone; quick. False says
/// nothing: the mesh may be closed by position, or an edge crowded.
bool closed_by_index(std::size_t points, std::span<const Triangle> triangles);

/// Pairs sides that run along the same edge in opposite directions, and joins their faces. True
/// only if each side has a partner; quick. False says nothing, and `faces` is no use then.
bool join_opposite_sides(std::size_t points, std::span<const Triangle> triangles,
                         DisjointSets& faces);

/// The ends of edges of exactly one triangle, ascending.
std::vector<std::uint32_t> border_points(std::size_t points, std::span<const Triangle> triangles);

/// For each point the smallest index of a point at the same position.
std::vector<std::uint32_t> first_at_position(std::span<const Vec3> points);

/// Number of connected groups of edges; `group[e]` is the group of edge e, numbered by first edge.
std::uint32_t edge_groups(const std::vector<std::array<std::uint32_t, 2>>& edges,
                          std::vector<std::uint32_t>& group);

/// Adds for each group of odd edges the mean of its points and a cone from the edges to it.
/// Afterwards `odd_edges` is empty, since an even number of odd edges meets in every point. \pre
/// edges == odd_edges(points, triangles)
void close_with_cones(const std::vector<std::array<std::uint32_t, 2>>& edges,
                      std::vector<Vec3>& points, std::vector<Triangle>& triangles);

} // namespace gewebe::mesh
