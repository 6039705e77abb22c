#pragma once
// Barrier potential of contact (Li et al., Incremental Potential Contact, ACM TOG 39(4), 2020):
// b(s) = -(s - S)^2 ln(s / S) for 0 < s < S, else 0, of s = d^2 - d_min^2, where d is the distance
// of a pair and S = (d_min + d_hat)^2 - d_min^2. Lengths in mm.

#include "contact/contact_pairs.h"
#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::contact {

/// b and its derivatives with respect to s.
struct BarrierValue {
  double value = 0, first = 0, second = 0;
};

/// S of a pair.
inline double barrier_range(double d_hat, double d_min) {
  return d_hat * (2 * d_min + d_hat);
}

/// \param s  d^2 - d_min^2; the value is +inf where s <= 0 or NaN
BarrierValue barrier(double s, double range);

/// Energy: sum over pairs of kappa weight mollifier b. +inf where a pair is no further apart than
/// its d_min.
double barrier_energy(const ContactPairs& pairs, std::span<const Vec3> x, double kappa);

/// Adds the gradient, pair by pair. Those of one pair sum to zero, except for rounding.
/// \param gradient  by vertex of the surface
/// \return the energy
double add_barrier_gradient(const ContactPairs& pairs, std::span<const Vec3> x, double kappa,
                            std::span<Vec3> gradient);

/// Contact force of each pair on its vertices: minus the gradient, in the order of the pairs'
/// vertices; 0 beyond their number. \param forces  overwritten; keeps its memory
void barrier_forces(const ContactPairs& pairs, std::span<const Vec3> x, double kappa,
                    std::vector<std::array<Vec3, 4>>& forces);

enum class HessianMode : std::uint8_t {
  exact,
  projected,   ///< each pair's, with negative eigenvalues set to 0
  gauss_newton ///< of rank one: kappa weight mollifier max(4 d^2 b'' + 2 b', 0) grad d grad d^T
};

/// Block of a Hessian: dense, row-major, of order 3 count.
struct HessianBlock {
  std::uint8_t count = 0;
  std::array<std::uint32_t, 4> vertex{};
  std::array<double, 144> entry{};
};

/// Blocks of all pairs in their order. \param blocks  overwritten; keeps its memory
void barrier_hessian(const ContactPairs& pairs, std::span<const Vec3> x, double kappa,
                     HessianMode mode, std::vector<HessianBlock>& blocks);

/// Smallest gap d - d_min of the pairs, and a vertex of that pair; +inf without any.
struct SmallestGap {
  double gap = 0;
  Vec3 position;
};
SmallestGap find_smallest_gap(const ContactPairs& pairs, std::span<const Vec3> x);
inline double smallest_gap(const ContactPairs& pairs, std::span<const Vec3> x) {
  return find_smallest_gap(pairs, x).gap;
}

} // namespace gewebe::contact
