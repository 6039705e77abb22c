#include "integrator/motion_stages_internal.h"

#include <cstddef>

namespace gewebe::integrator {

using numeric::Stage, numeric::stage_extension;

MotionStart MotionStages::start(const MotionState& state) const {
  if (is_second())
    return {place_, velocity_};
  return {state.place, state.velocity};
}

double MotionStages::allowed(const MotionState& state, const Numbers& at, double elastic) const {
  double work = 0;
  for (std::size_t axis = 0; axis < at.size(); ++axis)
    work += state.load[axis] * (at[axis] - place_[axis]);
  return first_->allowed + elastic + work;
}

void MotionStages::begin(Stage stage, const MotionState& state, std::span<const double> target,
                         SolidEnergy& energy) {
  stage_ = stage;
  if (!is_second()) {
    first_.reset();
    return;
  }
  const First& first = *first_;
  place_.resize(state.place.size());
  velocity_.resize(state.place.size());
  for (std::size_t axis = 0; axis < place_.size(); ++axis) {
    place_[axis] = numeric::extended(first.place[axis], state.place[axis]);
    velocity_[axis] = numeric::extended(first.velocity[axis], state.velocity[axis]);
    if (state.held[axis] == 0)
      continue;
    // Held axes go along the parabola through their three places: z is such that speed and
    // acceleration at the end are those of it.
    const double to = target.empty() ? state.place[axis] : target[axis];
    const double length = first.h, rest = stage_extension * length;
    const double once = (state.place[axis] - first.place[axis]) / length,
                 again = (to - state.place[axis]) / rest;
    const double acceleration = 2 * (again - once) / (length + rest);
    const double speed = again + acceleration * rest / 2;
    place_[axis] = to - length * speed;
    velocity_[axis] = speed - length * acceleration;
  }
  reached_ = energy.kept();
  energy.extend(first.kept, stage_extension);
}

void MotionStages::end(const MotionBody& body, double h, const MotionState& state,
                       const Numbers& at, const SolidEnergy& energy, double before, double after) {
  const Stage ended = stage_;
  stage_ = Stage::whole;
  reached_ = {};
  first_.reset();
  if (ended != Stage::first)
    return;
  double work = 0;
  for (std::size_t axis = 0; axis < at.size(); ++axis)
    work += state.load[axis] * (at[axis] - state.place[axis]);
  first_ = First{.place = state.place,
                 .velocity = state.velocity,
                 .kept = energy.kept(),
                 .h = h,
                 .allowed =
                     motion_energy(body, state.velocity) + before - after + stage_extension * work};
}

void MotionStages::abandon(SolidEnergy& energy) {
  if (is_second())
    energy.restore(reached_);
  stage_ = Stage::whole;
}

} // namespace gewebe::integrator
