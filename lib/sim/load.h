#pragma once
// What acts on one object, whichever method simulates it.

#include "base/vec3.h"
#include "model/model.h"

#include <cstdint>
#include <map>

namespace gewebe {

/// A node's own vector.
struct NodeVector {
  std::uint32_t node = 0;
  Vec3 value;

  bool operator==(const NodeVector&) const = default;
};

/// Nodes without a force have none, nodes without a displacement are free. Where both are given the
/// displacement holds, and its support carries the force too.
struct Load {
  std::map<std::uint32_t, Vec3> force{};        ///< 1e-6 N
  std::map<std::uint32_t, Vec3> displacement{}; ///< from rest, mm
  Vec3 gravity{};                               ///< mm/s²

  bool operator==(const Load&) const = default;
  bool empty() const { return force.empty() && displacement.empty() && gravity == Vec3{}; }
};

/// Whether the model holds `node` along `axis` (0 to 2).
inline bool is_fixed(const Model& model, std::size_t node, int axis) {
  return (model.nodes[node].fixed >> axis & 1) != 0;
}

} // namespace gewebe
