#pragma once
// The inner loop of a hyperelastic tangent. Compiled once per CPU level; every level gives the same
// bits: there is no fused multiplication, and each entry is summed in the order of the points.

#include <array>
#include <cstddef>

namespace gewebe {

/// Nodes of an element with its bubble, and room for a last group of four.
inline constexpr std::size_t tangent_nodes = 11, tangent_lanes = 12;

/// Of one point, dP/dF = a 1 + b F ⊗ F + c cof F ⊗ cof F + d d²J/dF².
struct TangentPoint {
  double weight = 0; ///< times the volume
  double a = 0, b = 0, c = 0, d = 0;
  std::array<double, 9> f{}, cofactor{};                       ///< by rows
  std::array<std::array<double, tangent_lanes>, 3> gradient{}; ///< by axis and node; others 0
};

/// Of nodes m <= n along i and j: [3 i + j][m][n]; what else is in there means nothing.
using TangentSums = std::array<std::array<std::array<double, tangent_lanes>, tangent_nodes>, 9>;

/// sums += weight ∇mᵀ (dP/dF) ∇n of the first `count` nodes.
using AddTangent = void (*)(const TangentPoint& point, std::size_t count, TangentSums& sums);
void add_tangent_baseline(const TangentPoint& point, std::size_t count, TangentSums& sums);
void add_tangent_avx2(const TangentPoint& point, std::size_t count, TangentSums& sums);

} // namespace gewebe
