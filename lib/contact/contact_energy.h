#pragma once
// The energy of contact in a step, barrier and lagged friction of the pairs at given positions, and
// how stiff the barrier is.

#include "collision/candidates.h"
#include "contact/barrier.h"
#include "contact/condensed_system.h"
#include "contact/contact_pairs.h"
#include "contact/friction.h"
#include "contact/step.h"
#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::contact {

class ContactEnergy {
public:
  /// \param begin  y_n \pre all outlive this
  ContactEnergy(const Island& island, const StepOptions& options, std::span<const Vec3> begin);

  bool has_friction() const { return rough_; }
  double typical_force() const { return typical_force_; }
  /// Length of a step of Newton's method below which positions have converged, mm.
  double step_limit() const;

  /// Scales the barrier by a typical force. \pre force > 0
  void set_stiffness(double force);
  /// Makes the barrier stiffer where forces have become much larger than the typical one: deep in
  /// the barrier Newton's steps are short. \param force  largest of those that balance
  /// \return whether it did
  bool raise_stiffness(double force);

  /// Takes the active pairs among candidates at x. What follows is of these pairs.
  void find_pairs(const collision::Candidates& candidates, std::span<const Vec3> x);
  const ContactPairs& pairs() const { return pairs_; }
  /// \pre pairs are those of x
  double energy(std::span<const Vec3> x) const;
  /// Adds the gradient. \return the energy
  double add_gradient(std::span<const Vec3> x, std::span<Vec3> gradient) const;
  /// Makes the Hessian that of a system, with the vertices of the pairs active.
  void assemble(std::span<const Vec3> x, HessianMode mode, CondensedSystem& system);
  /// A part of the step with the last such Hessian, from x to `to`, is taken.
  void advance_duals(std::span<const Vec3> x, std::span<const Vec3> to, double part);

  /// Renews the normal forces and tangent planes of friction. \param damped  normal forces take
  /// half of their change: where friction itself brings them forth, whole changes may alternate for
  /// ever
  void lag(std::span<const Vec3> x, bool damped);
  /// Renews them where that changes forces on these vertices by more than the tolerance; else those
  /// stay that the forces balance with. \return whether it did
  bool renew_lag(std::span<const Vec3> x, std::span<const std::uint32_t> vertices, bool damped);
  /// Vertices that friction is lagged at, as often as they are.
  std::vector<std::uint32_t> friction_vertices() const;
  std::uint64_t lags() const { return lags_; }
  /// Last change of a friction force by a lag, over the largest pair force.
  double friction_residual() const { return friction_residual_; }

  /// By ascending vertex and body.
  std::vector<ContactForce> forces(std::span<const Vec3> x) const;

private:
  void damp_lag(std::span<const FrictionPair> before);

  const Island& island_;
  const Parameters& parameters_;
  std::span<const Vec3> begin_; ///< y_n
  double d_hat_, stick_;
  double kappa_ = 0, typical_force_ = 0;
  double barrier_force_ = 0; ///< force at half of d_hat
  bool rough_ = false;       ///< some pairs have friction
  ContactPairs pairs_;
  std::vector<FrictionPair> friction_;
  std::vector<HessianBlock> blocks_, friction_blocks_;
  std::uint64_t lags_ = 0;
  double friction_residual_ = 0;
};

} // namespace gewebe::contact
