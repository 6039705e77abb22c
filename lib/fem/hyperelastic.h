#pragma once
// Tetrahedra under large displacements: energy, forces and tangent of one element of an isotropic
// hyperelastic material. With F = I + du/dx, C = FᵀF and J = det F the energy per volume at rest is
// W(F) + lambda/2 (J - 1)², with Lamé's constants of the small strain, mu and
// lambda = K - 2/3 mu. With I_1 = tr C, I_2 = (I_1² - tr C²)/2 and c_i = lambda_i² the eigenvalues
// of C, W is
//
// - stable_neo_hookean (Smith, de Goes, Kim, Stable Neo-Hookean flesh simulation, ACM TOG 37(2),
//   2018, eq. 14, with mu there 4/3 mu and lambda there lambda + 5/6 mu, as they say, so that small
//   strains have the constants given here):
//   2/3 mu (I_1 - 3) - 2/3 mu log((I_1 + 1)/4) - mu (J - 1) + 5/12 mu (J - 1)²;
//   finite and smooth for every F, flat and inverted ones too;
// - neo_hookean, the classical one: mu/2 (I_1 - 3) - mu log J; infinite unless J > 0;
// - mooney_rivlin (Mooney, J. Appl. Phys. 11, 1940; Rivlin, Phil. Trans. A 241, 1948):
//   C10 (I_1' - 3) + C01 (I_2' - 3) + mu/3 (J - 1)², mu = 2 (C10 + C01);
// - yeoh (Yeoh, Rubber Chem. Technol. 66(5), 1993):
//   C10 (I_1' - 3) + C20 (I_1' - 3)² + C30 (I_1' - 3)³ + mu/3 (J - 1)², mu = 2 C10;
// - ogden (Ogden, Proc. R. Soc. A 326, 1972) of one or two terms:
//   Σ_p 2 mu_p/alpha_p² (Σ_i lambda_i'^alpha_p - 3) + mu/3 (J - 1)², mu = mu_1 + mu_2;
//
// with I_1' = J^(-2/3) I_1, I_2' = J^(-4/3) I_2 and lambda_i' = J^(-1/3) lambda_i (Flory, Trans.
// Faraday Soc. 57, 1961). So the last three are an isochoric law and K/2 (J - 1)². Ogden's own
// mu_p is 2/alpha_p times the one here. The parameters of a law are relative to mu
// (model/hyperelastic_law.h).
//
// The last three are extended to flat and inverted elements, twice differentiable, so that each F
// has an energy: powers of J go on below J = 0.1 as their Taylor polynomials of degree 2. Powers of
// c_i in Ogden's law (of c_j c_k where alpha is negative: that sum is the same where J = 1) go on
// below 1e-4, a stretch of 0.01, as cubics. Where I_1 < 0.64, which no F with J >= 0.1 has, there
// is 20 mu (1 - I_1/0.64)³ besides, so that elements don't collapse into a point.
//
// Elements are those of fem/element.h: linear, and quadratic with the bubble and J projected on
// linear functions, which is what the mixed form with a linear, discontinuous pressure
// p = lambda (projected J - 1) comes to. So nothing locks as nu goes to 1/2, at any displacement,
// and at rest the tangent is that of fem/element.h, its bubble eliminated: to rounding, for
// linear and quadratic elements, all laws. W, its parts in J too, isn't projected. The bubble's
// amplitude is an unknown of the element (it can't be eliminated in closed form), the eleventh node
// here.
//
// Quadratic elements are integrated by 24 points that are exact to degree 6 (Keast, Moderate-degree
// tetrahedral quadrature formulas, 1986), as the bubble's stiffness at rest requires.
//
// A viscoelastic element has in each step the energy of fem/element.h's ElementMemory.
//
// Units: mm, Pa, forces g mm/s², energies g mm²/s² (1e-9 J).

#include "fem/element.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <span>

namespace gewebe::fem {

/// Of one element under given displacements.
struct HyperelasticResponse {
  static constexpr std::size_t nodes = 11; ///< at most: 4, or 10 and the bubble
  double energy = 0;
  std::array<Vec3, nodes> force{}; ///< -dE/du of each node, then of the bubble
  /// -dforce/du: [33 (3 a + i) + 3 b + j] is what node a along i loses per displacement of b along
  /// j; symmetric. Linear elements fill the first 12 rows and columns.
  std::array<double, 9 * nodes * nodes> tangent{};
  /// lambda times the projected J - 1 at the corners, Pa, by the displacements alone.
  std::array<double, 4> pressure{};
  /// With a tangent: the derivative by each node of the integral of J times each corner's
  /// barycentric coordinate, over the volume of the element.
  std::array<std::array<Vec3, nodes>, 4> volume_slope{};
};

/// Parts of a response to compute; each includes those before it.
enum class HyperelasticPart {
  energy,
  force,
  tangent,
  /// The tangent with the negative eigenvalues of the energy's second derivative by F, the pressure
  /// held, raised in each point to a thousandth of mu (as Smith, de Goes, Kim do to 0): positive
  /// semidefinite, for a step of Newton that must go downhill. Nearly the tangent close to rest.
  positive_tangent
};

/// Replaces the requested parts of `response`, by the element's law. A classical Neo-Hookean
/// element that is flat or inverted in one of its points has the energy HUGE_VAL, and nothing else
/// of it is set; so has an element of any law whose energy is too large for a number.
/// \param own  pressures at the corners as unknowns of their own: force and tangent are those under
/// these, the tangent with the pressure that J makes added as ever; null: they are those of J
/// \pre u.size() is 4 (the bubble isn't used then) or 10
void hyperelastic_response(const SolidElement& element, std::span<const Vec3> u, const Vec3& bubble,
                           HyperelasticPart part, HyperelasticResponse& response,
                           const std::array<double, 4>* own = nullptr);

/// lambda times the projection of a change of volume, whose moments with the corners' barycentric
/// coordinates are given per volume.
std::array<double, 4> projected_pressure(const SolidElement& element, bool quadratic,
                                         const std::array<double, 4>& moment);

/// Of one element without its tangent, as in HyperelasticResponse.
struct HyperelasticForces {
  double energy = 0;
  std::array<Vec3, HyperelasticResponse::nodes> force{};
  std::array<double, 4> pressure{};
};

/// Energies and forces of up to four elements; quadratic stable Neo-Hookean ones side by side. To
/// rounding as hyperelastic_response() and settled_bubble().
/// \param u  of `nodes` (4 or 10) nodes each
/// \param bubbles  those of quadratic elements; without `own` from where they are sought, and
/// become those that are found
/// \param own  as in hyperelastic_response(), of each element, or empty
void hyperelastic_forces(std::span<const SolidElement> elements, std::size_t nodes,
                         std::span<const std::array<Vec3, 10>> u, std::span<Vec3> bubbles,
                         std::span<const std::array<double, 4>> own,
                         std::span<HyperelasticForces> forces);

/// The bubble of least energy of a quadratic element, its nodes displaced by u, by Newton's method
/// downhill from `start`, with a positive second derivative. J is affine in the bubble and a stable
/// Neo-Hookean W is convex in the rest, so that there is one minimum; of other laws it is one that
/// lies downhill. What is left of the force on it is of the second order in the energy's rounding.
/// `start` itself where its energy isn't finite. \pre u.size() is 10, all finite
Vec3 settled_bubble(const SolidElement& element, std::span<const Vec3> u, const Vec3& start);

/// One point of an element without its memory.
struct HyperelasticPointState {
  double weight = 0; ///< mm³ at rest
  double energy = 0; ///< W_d = W - mu/3 (J - 1)² per volume, which a viscoelastic element relaxes
  SymmetricTensor stress{}; ///< S = 2 dW_d/dC, Pa
  SymmetricTensor strain{}; ///< C - I
  bool is_sound = true;     ///< J is 0.1 at least; else the stress is 0
};

/// Of the point of a linear element, or the 24 of a quadratic one. \pre u.size() is 4 or 10
void point_states(const SolidElement& element, std::span<const Vec3> u, const Vec3& bubble,
                  std::span<HyperelasticPointState> to);

/// The forces that a force per volume at rest puts on the nodes, and on the bubble as the last.
/// \pre force.size() is 4 (no bubble) or 11
void hyperelastic_body_load(const SolidElement& element, const Vec3& force_density,
                            std::span<Vec3> force);

} // namespace gewebe::fem
