#pragma once
// The two stages of a step of second order of integrator/solid_motion.h, see numeric/two_stages.h.

#include "integrator/motion_body_internal.h"
#include "integrator/motion_forecast_internal.h"
#include "integrator/motion_objective_internal.h"
#include "integrator/solid_energy_internal.h"
#include "numeric/two_stages.h"

#include <optional>

namespace gewebe::integrator {

class MotionStages {
public:
  /// Whether the last step was a first stage of h, and nothing has moved the body since.
  bool has_first(double h) const noexcept { return first_ && first_->h == h; }
  /// The stage that has begun.
  numeric::Stage stage() const noexcept { return stage_; }
  bool is_second() const noexcept { return stage_ == numeric::Stage::second; }
  /// Where the inertia of the stage begins.
  MotionStart start(const MotionState& state) const;
  /// Energy that the body may have at its end, when it ends at `at`: of motion and elements,
  /// without the potential of the load. \pre is_second() \param elastic  of the present place
  double allowed(const MotionState& state, const Numbers& at, double elastic) const;

  /// Begins a stage. Of a second one damping counts from what is extrapolated.
  /// \pre a second one: has_first(h) \param target  places of held axes at its end, or none
  void begin(numeric::Stage stage, const MotionState& state, std::span<const double> target,
             SolidEnergy& energy);
  /// Before the state goes on to `at`, and before the energy keeps what belongs to that.
  /// \param before, after  elastic energies of both
  void end(const MotionBody& body, double h, const MotionState& state, const Numbers& at,
           const SolidEnergy& energy, double before, double after);
  /// What has begun is abandoned. The first stage stays, as a step of its own.
  void abandon(SolidEnergy& energy);
  /// The state is another one.
  void forget() { first_.reset(); }

  MotionForecast& forecast() noexcept { return forecast_; } ///< of second stages
  const MotionForecast& forecast() const noexcept { return forecast_; }

private:
  /// What a first stage leaves.
  struct First {
    Numbers place, velocity; ///< where it began
    KeptStep kept;
    double h = 0;
    double allowed = 0; ///< energy at its beginning, work of its load and less of its elements
  };
  numeric::Stage stage_ = numeric::Stage::whole;
  std::optional<First> first_;
  Numbers place_, velocity_; ///< z of the second stage
  KeptStep reached_;         ///< at the end of the first stage, while the second one is open
  MotionForecast forecast_;
};

} // namespace gewebe::integrator
