#pragma once
// Closest features of a candidate pair, by its number of vertices.

#include "collision/distance.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>

namespace gewebe::collision {

/// Closest features of two primitives. \param x  vertices in the order of distance.h
/// \param first  number of vertices of the first primitive: 2 for two edges, else 1
template <std::size_t n>
ClosestFeature closest_feature(const std::array<Vec3, n>& x, std::size_t first) {
  if constexpr (n == 2)
    return {DistanceType::point_point, {0, 1, 0, 0}};
  else if constexpr (n == 3)
    return point_edge_feature(x);
  else
    return first == 1 ? point_triangle_feature(x) : edge_edge_feature(x);
}

} // namespace gewebe::collision
