#pragma once
// Lagged, smoothed Coulomb friction (Li et al., Incremental Potential Contact, ACM TOG 39(4), 2020,
// section 5): the energy of a pair is mu lambda f0(|u|), where lambda, the tangent plane and the
// closest points are those of an earlier position, and u is the tangential displacement since the
// start of the step. f0'(u) = 2 u/e - (u/e)^2 for u < e, else 1. Lengths in mm.

#include "collision/surface.h"
#include "contact/barrier.h"
#include "contact/contact_pairs.h"
#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::contact {

/// Friction coefficients by owners.
using FrictionTable = collision::OwnerTable<double>;

/// What friction of a pair is lagged to.
struct FrictionPair {
  std::uint8_t count = 0; ///< vertices: 2 to 4
  std::uint8_t first = 0; ///< vertices of the first surface
  std::array<std::uint32_t, 4> vertex{};
  std::array<double, 4> weight{}; ///< relative displacement = sum of weight times displacement
  std::array<Vec3, 2> tangent;    ///< orthonormal
  Vec3 normal;                    ///< unit, towards the vertices of positive weight
  double normal_force = 0;        ///< lambda with the pair's weight, which may be negative
  double limit = 0;               ///< mu times normal_force
  double added_stick = 0;         ///< to e
  /// Dual variable of primal-dual iterations: the friction force over the limit, as the last step
  /// predicted it; at most 1 long, and 0 until then.
  Vec3 dual;
};

/// Friction pairs of the active pairs at x. Left out: pairs without friction, and nearly parallel
/// edges, whose closest points jump.
/// \param friction  by owners of the surface
/// \param result  overwritten; keeps its memory
void lag_friction(const collision::CollisionSurface& surface, const ContactPairs& pairs,
                  std::span<const Vec3> x, double kappa, const FrictionTable& friction,
                  std::vector<FrictionPair>& result);

/// Makes lagged friction fit for meshes, whose facets are not the surface that they stand for.
///
/// A vertex that is about to pass another one, or an edge, is pushed aside by it, and edges that
/// are all but parallel push in any direction. Where a surface is flat, friction acts along it and
/// not across the direction of such a pair. And slip is not known better than to the tilt of facets
/// against each other times the approach of both surfaces in the step: smaller slip has no fully
/// developed friction. Otherwise the direction of friction in an impact is that of noise.
/// \param stick_per_approach  that tilt
void align_friction(const collision::CollisionSurface& surface, std::span<const Vec3> x,
                    std::span<const Vec3> x_start, double stick_per_approach,
                    std::span<FrictionPair> pairs);

/// f0, f0' / u and (f0'' - f0' / u) / u^2 at u, for e > 0.
struct FrictionValue {
  double value = 0, first_over_u = 0, second = 0;
};
FrictionValue smooth_friction(double u, double e);

/// Energy of friction for displacements x - x_start; e: eps_v times the time step, or eps_u;
/// each pair adds its own part.
double friction_energy(std::span<const FrictionPair> pairs, std::span<const Vec3> x,
                       std::span<const Vec3> x_start, double e);

/// Adds the gradient, pair by pair. \return the energy
double add_friction_gradient(std::span<const FrictionPair> pairs, std::span<const Vec3> x,
                             std::span<const Vec3> x_start, double e, std::span<Vec3> gradient);

/// Friction force of each pair on its vertices: minus the gradient; 0 beyond their number.
void friction_forces(std::span<const FrictionPair> pairs, std::span<const Vec3> x,
                     std::span<const Vec3> x_start, double e,
                     std::vector<std::array<Vec3, 4>>& forces);

/// Blocks of the Hessian, which is positive semidefinite except for pairs of negative weight. Where
/// it is not to be exact, these are left out, and it is that of the primal-dual method (Chan,
/// Golub, Mulet, SIAM J. Sci. Comput. 20(6), 1999): along the slip it has the dual in place of the
/// force's direction, and so becomes soft only where the force has come to stay. Newton's steps
/// with the exact one throw pairs to and fro. \param blocks  overwritten
void friction_hessian(std::span<const FrictionPair> pairs, std::span<const Vec3> x,
                      std::span<const Vec3> x_start, double e, HessianMode mode,
                      std::vector<HessianBlock>& blocks);

/// Takes a part of a step of the primal-dual method, from x to `to`, for the duals.
void advance_duals(std::span<FrictionPair> pairs, std::span<const Vec3> x, std::span<const Vec3> to,
                   std::span<const Vec3> x_start, double e, double part);
/// Gives pairs the duals of those of the same vertices.
void keep_duals(std::span<const FrictionPair> before, std::span<FrictionPair> pairs);

} // namespace gewebe::contact
