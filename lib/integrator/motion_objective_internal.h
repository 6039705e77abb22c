#pragma once
// What a step of integrator/solid_motion.h makes least.

#include "base/context.h"
#include "geometry/vec3.h"
#include "integrator/motion_body_internal.h"
#include "integrator/solid_energy_internal.h"

#include <cmath>
#include <span>

namespace gewebe::integrator {

/// A place with what is known of it.
struct MotionPoint {
  Numbers at;
  Numbers gradient; ///< 0 on held axes
  Numbers forces;   ///< what holders must push with, on all axes
  double value = HUGE_VAL;
  double unsure = 0; ///< of the value, by rounding
};

/// Rigid motion: a rotation about the centre of mass, then a translation.
struct RigidChange {
  double turn = 1; ///< unit quaternion of the rotation: this and `axis`
  Vec3 axis;
  Vec3 translation;
  double largest = 0; ///< bound on the displacement of a node, mm
};

/// Where the inertia of a step begins: the state, or what a second stage extrapolates.
struct MotionStart {
  std::span<const double> place, velocity;
};

class MotionObjective {
public:
  /// Of a step of h. \pre all outlive this; the state doesn't change meanwhile
  MotionObjective(const MotionBody& body, const MotionState& state, const MotionStart& start,
                  SolidEnergy& energy, double h, const SolidMotionOptions& options);

  /// At point.at, with what MotionQuick::turn() needs, if `turns`. Counted by evaluations().
  void evaluate(MotionPoint& point, const Context& context, bool turns = false) const;
  /// The value of the state's shape, moved without a turn to `at`, its elastic energy given.
  double value_of_shape(const Numbers& at, double elastic) const;
  /// Rigid motion of a free body at `at` that balances the sums of forces and of moments of
  /// inertia, the load and further forces, which keep their directions. Elastic energy stays, so
  /// that it lowers the value. It turns a body that these compress by a first approximation alone,
  /// as there the balance is not stable. \param more  3 n, or none
  RigidChange balance(std::span<const double> at, std::span<const double> more) const;
  void move(MotionPoint& point, const RigidChange& by) const;
  /// Translates a free body to where its momentum and the load lead.
  void keep_momentum(MotionPoint& point) const;
  /// Turns it, too.
  void keep_both_momenta(MotionPoint& point) const;

  const MotionBody& body() const noexcept { return body_; }
  const MotionState& state() const noexcept { return state_; }
  const MotionStart& start() const noexcept { return start_; }
  SolidEnergy& energy() const noexcept { return energy_; }
  double step() const noexcept { return step_; }
  double damping() const noexcept { return damping_; } ///< per stiffness
  int evaluations() const noexcept { return evaluations_; }

private:
  Vec3 centre(std::span<const double> at) const;

  const MotionBody& body_;
  const MotionState& state_;
  MotionStart start_;
  SolidEnergy& energy_;
  double step_, damping_;
  Numbers mass_;  ///< by node, times its inertia
  Numbers ahead_; ///< where inertia alone leads
  mutable int evaluations_ = 0;
};

} // namespace gewebe::integrator
