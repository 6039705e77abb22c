#include "integrator/motion_objective_internal.h"

#include "geometry/vector_at.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace gewebe::integrator {

MotionObjective::MotionObjective(const MotionBody& body, const MotionState& state,
                                 const MotionStart& start, SolidEnergy& energy, double h,
                                 const SolidMotionOptions& options)
    : body_(body), state_(state), start_(start), energy_(energy), step_(h),
      damping_(options.damping / h), mass_(body.nodes()),
      ahead_(start.place.begin(), start.place.end()) {
  for (std::size_t i = 0; i < body.nodes(); ++i)
    mass_[i] = body.masses[i] * body.inertia(i, h);
  if (!std::isfinite(h))
    return; // at rest, without inertia
  for (std::size_t axis = 0; axis < body.axes(); ++axis)
    ahead_[axis] += h / (1 + body.drag[axis / 3] * h) * start.velocity[axis];
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

namespace {

/// Newton iterations, and the angle of the last one.
constexpr int max_turns = 10;
constexpr double least_angle = 1e-15;

/// Rotation R that makes the trace of R B larger, up to a maximum next to the identity: there R B
/// is symmetric, and the moment of the forces vanishes. \param drawn  B, the sum of arm force^T
/// \param spread  sum of mass arm arm^T
Eigen::Quaterniond balancing_rotation(const Eigen::Matrix3d& drawn, const Eigen::Matrix3d& spread) {
  Eigen::Quaterniond all = Eigen::Quaterniond::Identity();
  const Eigen::Matrix3d inertia = spread.trace() * Eigen::Matrix3d::Identity() - spread;
  Eigen::Matrix3d b = drawn;
  for (int k = 0; k < max_turns; ++k) {
    const Eigen::Vector3d moment(b(1, 2) - b(2, 1), b(2, 0) - b(0, 2), b(0, 1) - b(1, 0));
    const Eigen::Matrix3d second =
        b.trace() * Eigen::Matrix3d::Identity() - (b + b.transpose()) / 2;
    Eigen::LLT<Eigen::Matrix3d> factor(second);
    const bool stable = factor.info() == Eigen::Success;
    if (!stable) {
      if (k > 0)
        break;
      factor.compute(inertia);
      if (factor.info() != Eigen::Success)
        break; // on a line
    }
    const Eigen::Vector3d way = factor.solve(moment);
    const double angle = way.norm();
    if (!(angle > least_angle) || !(angle < 1))
      break;
    // By the angle to third order, without a sine: the same on every processor.
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond(1, way[0] / 2, way[1] / 2, way[2] / 2).normalized();
    const Eigen::Matrix3d next = turn.toRotationMatrix() * b;
    if (!(next.trace() >= b.trace()))
      break;
    b = next;
    all = (turn * all).normalized();
    if (!stable)
      break;
  }
  return all;
}

} // namespace

Vec3 MotionObjective::centre(std::span<const double> at) const {
  Vec3 sum;
  double mass = 0;
  for (std::size_t i = 0; i < body_.nodes(); ++i) {
    sum += mass_[i] * vector_at(at, i);
    mass += mass_[i];
  }
  return sum / mass;
}

RigidChange MotionObjective::balance(std::span<const double> at,
                                     std::span<const double> more) const {
  RigidChange by;
  const Vec3 middle = centre(at);
  double mass = 0, radius = 0; // mass: times inertia
  Vec3 force;
  Eigen::Matrix3d drawn = Eigen::Matrix3d::Zero(), spread = drawn;
  for (std::size_t i = 0; i < body_.nodes(); ++i) {
    const Vec3 arm = vector_at(at, i) - middle;
    const Vec3 load =
        more.empty() ? vector_at(state_.load, i) : vector_at(state_.load, i) + vector_at(more, i);
    // Rounding of differences that are small does not add up over many small steps.
    force += mass_[i] * (vector_at(ahead_, i) - vector_at(at, i)) + load;
    const Vec3 pull = mass_[i] * (vector_at(ahead_, i) - middle) + load;
    mass += mass_[i];
    radius = std::max(radius, norm(arm));
    const Eigen::Vector3d a(arm.x, arm.y, arm.z);
    drawn += a * Eigen::RowVector3d(pull.x, pull.y, pull.z);
    spread += mass_[i] * a * a.transpose();
  }
  by.translation = force / mass;
  const Eigen::Quaterniond turn = balancing_rotation(drawn, spread);
  by.turn = turn.w();
  by.axis = {turn.x(), turn.y(), turn.z()};
  by.largest = norm(by.translation) + 2 * radius * norm(by.axis);
  return by;
}

void MotionObjective::move(MotionPoint& point, const RigidChange& by) const {
  const Vec3 middle = centre(point.at);
  for (std::size_t i = 0; i < body_.nodes(); ++i) {
    const Vec3 once = cross(by.axis, vector_at(point.at, i) - middle);
    const Vec3 way = by.translation + 2 * (by.turn * once + cross(by.axis, once));
    for (int axis = 0; axis < 3; ++axis)
      point.at[axis_of(static_cast<std::uint32_t>(i), axis)] += way[axis];
  }
}

void MotionObjective::keep_momentum(MotionPoint& point) const {
  RigidChange by = balance(point.at, {});
  by.turn = 1;
  by.axis = {};
  move(point, by);
}

void MotionObjective::keep_both_momenta(MotionPoint& point) const {
  move(point, balance(point.at, {}));
}

} // namespace gewebe::integrator
