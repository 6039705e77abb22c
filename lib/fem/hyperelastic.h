#pragma once
// Tetrahedra under large displacements: energy, forces and tangent of one element of an isotropic
// hyperelastic material. With F = I + du/dx, I_C = tr FᵀF and J = det F the energy per volume at
// rest is W(F) + lambda/2 (J - 1)², with Lamé's constants of the small strain and
//
// - stable Neo-Hookean (Smith, de Goes, Kim, Stable Neo-Hookean flesh simulation, ACM TOG 37(2),
//   2018, eq. 14, with mu there 4/3 mu and lambda there lambda + 5/6 mu, as they say, so that small
//   strains have the constants given here):
//   W = 2/3 mu (I_C - 3) - 2/3 mu log((I_C + 1)/4) - mu (J - 1) + 5/12 mu (J - 1)²;
//   finite and smooth for every F, flat and inverted ones too;
// - Neo-Hookean, the classical one: W = mu/2 (I_C - 3) - mu log J; infinite unless J > 0.
//
// Elements are those of fem/element.h: linear, and quadratic with the bubble and J projected on
// linear functions, which is what the mixed form with a linear, discontinuous pressure
// p = lambda (projected J - 1) comes to. So nothing locks as nu goes to 1/2, at any displacement,
// and at rest the tangent is that of fem/element.h, its bubble eliminated: to rounding, for
// linear and quadratic elements, both laws. W, its small parts in J too, isn't projected. The
// bubble's amplitude is an unknown of the element (it can't be eliminated in closed form), the
// eleventh node here.
//
// Quadratic elements are integrated by 24 points that are exact to degree 6 (Keast, Moderate-degree
// tetrahedral quadrature formulas, 1986), as the bubble's stiffness at rest asks.
//
// Units: mm, Pa, forces g mm/s², energies g mm²/s² (1e-9 J).

#include "fem/element.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <span>

namespace gewebe {

enum class HyperelasticLaw { stable_neo_hookean, neo_hookean };

/// Of one element under given displacements.
struct HyperelasticResponse {
  static constexpr std::size_t nodes = 11; ///< at most: 4, or 10 and the bubble
  double energy = 0;
  std::array<Vec3, nodes> force{}; ///< -dE/du of each node, then of the bubble
  /// -dforce/du: [33 (3 a + i) + 3 b + j] is what node a along i loses per displacement of b along
  /// j; symmetric. Linear elements fill the first 12 rows and columns.
  std::array<double, 9 * nodes * nodes> tangent{};
};

/// What of it is wanted; each one costs what stands before it too.
enum class HyperelasticPart {
  energy,
  force,
  tangent,
  /// The tangent with the negative eigenvalues of the energy's second derivative by F, the pressure
  /// held, raised in each point to a thousandth of mu (as Smith, de Goes, Kim do to 0): positive
  /// semidefinite, for a step of Newton that must go downhill. Nearly the tangent close to rest.
  positive_tangent
};

/// Replaces what `response` had of the parts wanted. A classical Neo-Hookean element that is flat
/// or inverted in one of its points has the energy HUGE_VAL, and nothing else of it is set.
/// \pre u.size() is 4 (the bubble isn't used then) or 10
void hyperelastic_response(const SolidElement& element, HyperelasticLaw law,
                           std::span<const Vec3> u, const Vec3& bubble, HyperelasticPart part,
                           HyperelasticResponse& response);

/// The bubble of least energy of a quadratic stable Neo-Hookean element, its nodes displaced by u,
/// by Newton's method from `start`. J is affine in the bubble and W convex in the rest, so there is
/// one minimum; what is left of the force on it is of the second order in the energy's rounding.
/// \pre u.size() is 10, all finite
Vec3 settled_bubble(const SolidElement& element, std::span<const Vec3> u, const Vec3& start);

/// The forces that a force per volume at rest puts on the nodes, and on the bubble as the last.
/// \pre force.size() is 4 (no bubble) or 11
void hyperelastic_body_load(const SolidElement& element, const Vec3& force_density,
                            std::span<Vec3> force);

} // namespace gewebe
