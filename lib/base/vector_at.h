#pragma once
// Three numbers a node, one vector.

#include "base/vec3.h"

#include <cstddef>
#include <span>

namespace gewebe {

/// The vector of a node where x, y and z of node 0, of node 1, ... stand in a row.
inline Vec3 vector_at(std::span<const double> values, std::size_t node) {
  return {values[3 * node], values[3 * node + 1], values[3 * node + 2]};
}

} // namespace gewebe
