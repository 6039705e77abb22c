#pragma once
// What a step of integrator/solid_motion.h makes least.

#include "base/context.h"
#include "integrator/motion_body_internal.h"
#include "integrator/solid_energy_internal.h"

#include <array>
#include <cmath>

namespace gewebe {

/// A place with what is known of it.
struct MotionPoint {
  Numbers at;
  Numbers gradient; ///< 0 on held axes
  Numbers forces;   ///< what holders must push with, on all axes
  double value = HUGE_VAL;
  double unsure = 0; ///< of the value, by rounding
};

class MotionObjective {
public:
  /// Of a step of h. \pre all outlive this; the state doesn't change meanwhile
  MotionObjective(const MotionBody& body, const MotionState& state, SolidEnergy& energy, double h,
                  const SolidMotionOptions& options);

  /// At point.at, with what MotionQuick::turn() needs, if `turns`. Counted by evaluations().
  void evaluate(MotionPoint& point, const Context& context, bool turns = false) const;
  /// The value of the state's shape, moved without a turn to `at`, its elastic energy given.
  double value_of_shape(const Numbers& at, double elastic) const;
  /// Displacement by which a free body at `at` is off the motion that its momentum, the load and
  /// further forces give it. \param more  3 n, or none
  std::array<double, 3> momentum_off(std::span<const double> at,
                                     std::span<const double> more) const;
  /// A free body goes on with its momentum and the load's: moves it by what unfinished rounds took
  /// or gave.
  void keep_momentum(MotionPoint& point) const;

  const MotionBody& body() const noexcept { return body_; }
  const MotionState& state() const noexcept { return state_; }
  SolidEnergy& energy() const noexcept { return energy_; }
  double step() const noexcept { return step_; }
  double damping() const noexcept { return damping_; } ///< per stiffness
  int evaluations() const noexcept { return evaluations_; }

private:
  const MotionBody& body_;
  const MotionState& state_;
  SolidEnergy& energy_;
  double step_, damping_;
  Numbers mass_;  ///< by node, times its inertia
  Numbers ahead_; ///< where inertia alone leads
  mutable int evaluations_ = 0;
};

} // namespace gewebe
