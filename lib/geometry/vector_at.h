#pragma once
// Vectors of nodes in arrays with three numbers per node.

#include "geometry/vec3.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe {

/// The vector of a node in an array of x, y and z of node 0, of node 1, ...
inline Vec3 vector_at(std::span<const double> values, std::size_t node) {
  return {values[3 * node], values[3 * node + 1], values[3 * node + 2]};
}

/// Index of an axis of a node in such an array.
inline std::size_t axis_of(std::uint32_t node, int axis) {
  return 3 * std::size_t{node} + static_cast<std::size_t>(axis);
}

/// The largest absolute value; NaN if one is NaN; 0 for an empty array.
inline double largest_size(std::span<const double> values) {
  double size = 0;
  for (const double value : values)
    size = std::isnan(value) ? value : std::max(size, std::abs(value));
  return size;
}

} // namespace gewebe
