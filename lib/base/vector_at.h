#pragma once
// Three numbers a node, one vector.

#include "base/vec3.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe {

/// The vector of a node where x, y and z of node 0, of node 1, ... stand in a row.
inline Vec3 vector_at(std::span<const double> values, std::size_t node) {
  return {values[3 * node], values[3 * node + 1], values[3 * node + 2]};
}

/// Where an axis of a node stands in such a row.
inline std::size_t axis_of(std::uint32_t node, int axis) {
  return 3 * std::size_t{node} + static_cast<std::size_t>(axis);
}

/// The largest of the absolute values, NaN if one is; 0 of none.
inline double largest_size(std::span<const double> values) {
  double size = 0;
  for (const double value : values)
    size = std::isnan(value) ? value : std::max(size, std::abs(value));
  return size;
}

} // namespace gewebe
