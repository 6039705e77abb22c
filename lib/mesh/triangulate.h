#pragma once
// Triangles for a polygon in space.

#include "geometry/mesh.h"

#include <cstddef>
#include <span>
#include <vector>

namespace gewebe::mesh {

/// Corners that `triangulate_polygon` takes at most: its work grows with the square of the reflex
/// ones.
inline constexpr std::size_t max_polygon_corners = 10000;

/// Splits a polygon with n corners into exactly n - 2 triangles of the polygon's orientation,
/// appended to `out` as indices into `polygon`. Every corner is used, collinear ones too, so that
/// neighbours which share them stay joined. Strictly convex polygons become a fan from corner 0;
/// others are cut by ear clipping (Meisters 1975) in the coordinate plane nearest to their own
/// (normal by Newell's sums). A polygon without area or that crosses itself also gives n - 2
/// triangles, of no use as a surface. \pre polygon.size() >= 3 \throw Error if there are more than
/// max_polygon_corners
void triangulate_polygon(std::span<const Vec3> polygon, std::vector<Triangle>& out);

} // namespace gewebe::mesh
