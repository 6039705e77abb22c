#pragma once
// Inner loop of the elastodynamic method: forces of a block's springs, then one step of its nodes.
// It is compiled once per CPU level. Every level gives the same bits, because there is no fused
// multiplication and each sum has one fixed order.

#include <cstddef>
#include <cstdint>

namespace gewebe::dynamics {

/// A node's displacement from rest (mm) and velocity (mm/s) in one cache line; the fourth numbers
/// are 0.
struct alignas(64) NodeRow {
  double u[4], v[4];
};

/// Rest position of a node (mm); the fourth number is 0.
struct alignas(32) NodeRest {
  double p[4];
};

/// Load, drag and mass of a node.
struct alignas(64) NodeTraits {
  double constant[3]; ///< f + m g
  double drag;
  double inverse_mass[4]; ///< 0 along axes that can't move; the fourth number is 0
};

/// Four springs for SIMD. A group of fewer springs is filled up with springs that join a node to
/// itself and exert no force.
struct alignas(64) SpringGroup {
  double stiffness[4], damping[4], rest[4];
  std::uint32_t i[4], j[4]; ///< rows, by their NodeRest in bytes from the first one
};

/// Consecutive rows [first, first + count) and their springs. Both ends of a spring `within` are
/// rows of the block; of a spring `across` only i is, and only i is pulled.
struct SpringBlock {
  std::size_t first = 0, count = 0;
  const SpringGroup* within = nullptr;
  std::size_t within_count = 0;
  const SpringGroup* across = nullptr;
  std::size_t across_count = 0;
};

inline constexpr std::size_t largest_block = 256;

/// Square of a length, mm², below which a spring has no direction.
inline constexpr double min_square = 1e-300;

/// v' = v + h (constant - drag v + F) / m, u' = u + h v' for the rows of the block; F sums the
/// springs within, then those across, each in order. \return whether u' and v' are finite
using BlockStep = bool (*)(const SpringBlock& block, const NodeRest* rest, const NodeTraits* traits,
                           const NodeRow* now, NodeRow* next, double h);

bool block_step_baseline(const SpringBlock& block, const NodeRest* rest, const NodeTraits* traits,
                         const NodeRow* now, NodeRow* next, double h);
bool block_step_avx2(const SpringBlock& block, const NodeRest* rest, const NodeTraits* traits,
                     const NodeRow* now, NodeRow* next, double h);

} // namespace gewebe::dynamics
