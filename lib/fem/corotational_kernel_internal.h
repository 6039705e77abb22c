#pragma once
// The inner loops of fem/corotational.h: tetrahedra four at a time. Compiled once per CPU level;
// every level gives the same bits.

#include "base/cpu.h"
#include "fem/corotational.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace gewebe::fem {

/// Four tetrahedra side by side; those that fill up the last group have no volume.
template <std::size_t Nodes>
struct CorotationalGroup {
  static constexpr std::size_t nodes = Nodes;
  static constexpr std::size_t points = Nodes == 4 ? 1 : 4; ///< where strains are counted
  std::uint32_t node[Nodes][4];
  double gradient[3][3][4]; ///< of the second to fourth barycentric coordinate, 1/mm, by axis
  double volume[4], mu[4], lambda[4];
  double flexibility[Nodes == 4 ? 1 : 6][4]; ///< of the bubble, xx xy xz yy yz zz
};

/// Strains of a group in its own frames, [6 p + k] of point p, k as above.
template <std::size_t Nodes>
struct CorotationalStrains {
  double value[6 * CorotationalGroup<Nodes>::points][4];
};

/// By rows.
struct CorotationalRotations {
  double value[9][4];
};

/// What is made of a group.
template <std::size_t Nodes>
struct CorotationalResult {
  CorotationalRotations rotation;
  double force[3 * Nodes][4];    ///< on node a along i at 3 a + i
  double elastic[4], damping[4]; ///< energies, their weights left aside
};

inline constexpr std::size_t corotational_together = 16; ///< groups that are evaluated at once

/// Numbers a node that a group's evaluation adds to: its force, then, with turns, the rotations of
/// its elements times their volumes; the fourth is none without.
inline constexpr std::size_t corotational_force = 4, corotational_turned = 12;

/// Where a group's nodes have their sums.
template <std::size_t Nodes>
using CorotationalPlaces = std::array<std::array<std::uint16_t, 4>, Nodes>;

/// What evaluations read and write beside their groups.
template <std::size_t Nodes>
struct CorotationalTask {
  const double* x;                          ///< places of nodes
  const CorotationalPlaces<Nodes>* places;  ///< of the groups
  double* sums;                             ///< added to, as above
  bool turns;                               ///< whether they are computed
  const CorotationalStrains<Nodes>* before; ///< of the groups; may be null without damping
  CorotationalStrains<Nodes>* strains;      ///< of the groups; null: not computed
  CorotationalWeights weights;
};

/// Of `count` groups, corotational_together at most.
template <std::size_t Nodes>
using CorotationalEvaluate = void (*)(const CorotationalGroup<Nodes>* groups, std::size_t count,
                                      const CorotationalTask<Nodes>& task,
                                      CorotationalResult<Nodes>* results);

struct CorotationalKernel {
  CorotationalEvaluate<4> linear;
  CorotationalEvaluate<10> quadratic;
  /// Each of `count` groups of four matrices, [9 k + entry][lane], becomes the rotation nearest to
  /// it.
  void (*turn)(double (*matrices)[4], std::size_t count);
};

extern const CorotationalKernel corotational_kernel_baseline, corotational_kernel_avx2;

inline const CorotationalKernel& corotational_kernel(CpuLevel level) {
  return level == CpuLevel::baseline ? corotational_kernel_baseline : corotational_kernel_avx2;
}

} // namespace gewebe::fem
