#include "integrator/motion_objective_internal.h"

#include <array>

namespace gewebe {

MotionObjective::MotionObjective(const MotionBody& body, const MotionState& state,
                                 SolidEnergy& energy, double h, const SolidMotionOptions& options)
    : body_(body), state_(state), energy_(energy), step_(h), damping_(options.damping / h),
      mass_(body.nodes()), ahead_(state.place) {
  for (std::size_t i = 0; i < body.nodes(); ++i)
    mass_[i] = body.masses[i] * body.inertia(i, h);
  for (std::size_t axis = 0; axis < body.axes(); ++axis)
    ahead_[axis] += h / (1 + body.drag[axis / 3] * h) * state.velocity[axis];
}

void MotionObjective::evaluate(MotionPoint& point, const Context& context, bool turns) const {
  ++evaluations_;
  point.gradient.resize(body_.axes());
  point.forces.resize(body_.axes());
  const double energy =
      energy_.evaluate(point.at, {damping_, 1 / step_}, point.forces, context, turns);
  const auto [inertial, forced, work] = sums_of_axes<3>(
      context, body_.axes(), [&](std::size_t begin, std::size_t end, std::array<double, 3>& sums) {
        for (std::size_t axis = begin; axis < end; ++axis) {
          const double off = point.at[axis] - ahead_[axis], mass = mass_[axis / 3],
                       load = state_.load[axis];
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

double MotionObjective::value_of_shape(const Numbers& at, double elastic) const {
  double value = elastic - work_of_load(body_, state_.load, at);
  for (std::size_t axis = 0; axis < body_.axes(); ++axis)
    if (const double off = at[axis] - ahead_[axis]; state_.held[axis] == 0)
      value += mass_[axis / 3] * off * off / 2;
  return value;
}

std::array<double, 3> MotionObjective::momentum_off(std::span<const double> at,
                                                    std::span<const double> more) const {
  std::array<double, 3> off{};
  double mass = 0; // times inertia
  for (std::size_t i = 0; i < body_.nodes(); ++i)
    mass += mass_[i];
  for (std::size_t axis = 0; axis < body_.axes(); ++axis)
    off[axis % 3] += mass_[axis / 3] * (at[axis] - ahead_[axis]) - state_.load[axis] -
                     (more.empty() ? 0 : more[axis]);
  for (double& of : off)
    of /= mass;
  return off;
}

void MotionObjective::keep_momentum(MotionPoint& point) const {
  const std::array<double, 3> off = momentum_off(point.at, {});
  for (std::size_t axis = 0; axis < body_.axes(); ++axis)
    point.at[axis] -= off[axis % 3];
}

} // namespace gewebe
