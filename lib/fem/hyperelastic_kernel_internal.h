#pragma once
// The inner loops of hyperelastic elements: of a tangent, and forces of four elements at a time.
// Compiled once per CPU level; every level gives the same bits: there is no fused multiplication,
// and each entry is summed in the order of the points.

#include <array>
#include <cstddef>

namespace gewebe::fem {

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

/// The points of quadratic elements: barycentric coordinates, weights of a volume of 1, and what
/// the bubble's gradient has of each corner's. Weights are equal in four classes of points.
struct HyperelasticPoints {
  static constexpr std::size_t count = 24, classes = 4;
  static constexpr std::array<std::size_t, classes + 1> first{0, 4, 8, 12, 24};
  double at[count][4], weight[count], bubble[count][4];
};

/// Four quadratic stable Neo-Hookean elements side by side.
struct HyperelasticGroup {
  double gradient[4][3][4]; ///< of the barycentric coordinates, 1/mm, by axis
  double volume[4], mu[4], lambda[4];
  double u[10][3][4], bubble[3][4];
  double own[4][4]; ///< pressures, if they are unknowns
};

struct HyperelasticGroupResult {
  double force[11][3][4];
  double energy[4];     ///< less that of logarithms, over the volume
  double product[4][4]; ///< of (I_1 + 1) / 4 in each class of points, whose logarithms these are
  double pressure[4][4];
  double left[4]; ///< of the bubble's energy when its last step was taken, over mu
};

/// \param own  pressures are the group's own, and its bubbles stay; else bubbles move to where they
/// have least energy, and pressures are those of J
using EvaluateGroup = void (*)(const HyperelasticPoints& points, bool own, HyperelasticGroup& group,
                               HyperelasticGroupResult& result);
void evaluate_group_baseline(const HyperelasticPoints& points, bool own, HyperelasticGroup& group,
                             HyperelasticGroupResult& result);
void evaluate_group_avx2(const HyperelasticPoints& points, bool own, HyperelasticGroup& group,
                         HyperelasticGroupResult& result);

} // namespace gewebe::fem
