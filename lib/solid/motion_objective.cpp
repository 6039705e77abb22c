#include "solid/motion_objective_internal.h"

#include <array>

namespace gewebe {

MotionObjective::MotionObjective(const MotionBody& body, const MotionState& state,
                                 SolidEnergy& energy, double h, const SolidMotionOptions& options)
    : body_(body), state_(state), energy_(energy), inertia_(1 / (h * h) + options.drag / h),
      damping_(options.damping / h), ahead_(state.place) {
  add(ahead_, h / (1 + options.drag * h), state.velocity);
}

void MotionObjective::evaluate(MotionPoint& point, const Context& context) const {
  ++evaluations_;
  point.gradient.resize(body_.axes());
  point.forces.resize(body_.axes());
  const double energy = energy_.evaluate(point.at, damping_, point.forces, context);
  const auto [inertial, forced, work] = sums_of_axes<3>(
      context, body_.axes(), [&](std::size_t begin, std::size_t end, std::array<double, 3>& sums) {
        for (std::size_t axis = begin; axis < end; ++axis) {
          const double off = point.at[axis] - ahead_[axis],
                       mass = body_.masses[axis / 3] * inertia_, load = state_.load[axis];
          sums[1] += std::abs(point.forces[axis] * point.at[axis]);
          sums[2] += load * (point.at[axis] - body_.rest[axis]);
          point.forces[axis] = mass * off - point.forces[axis] - load;
          const bool held = state_.held[axis] != 0;
          point.gradient[axis] = held ? 0 : point.forces[axis];
          sums[0] += held ? 0 : mass * off * off / 2;
        }
      });
  point.value = energy + inertial - work;
  point.unsure = energy_.unsure_at_rest() + 1e-15 * forced +
                 1e-13 * (std::abs(energy) + std::abs(inertial) + std::abs(work));
}

double MotionObjective::value_of_standing(double elastic) const {
  double value = elastic - work_of_load(body_, state_.load, state_.place);
  for (std::size_t axis = 0; axis < body_.axes(); ++axis)
    if (const double off = state_.place[axis] - ahead_[axis]; state_.held[axis] == 0)
      value += body_.masses[axis / 3] * inertia_ * off * off / 2;
  return value;
}

void MotionObjective::keep_momentum(MotionPoint& point) const {
  std::array<double, 3> off{};
  double mass = 0;
  for (const double m : body_.masses)
    mass += m;
  for (std::size_t axis = 0; axis < body_.axes(); ++axis)
    off[axis % 3] +=
        body_.masses[axis / 3] * (point.at[axis] - ahead_[axis]) * inertia_ - state_.load[axis];
  for (std::size_t axis = 0; axis < body_.axes(); ++axis)
    point.at[axis] -= off[axis % 3] / (mass * inertia_);
}

} // namespace gewebe
