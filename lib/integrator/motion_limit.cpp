#include "integrator/motion_limit_internal.h"

#include "fem/matrix3_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe::integrator {

namespace {

/// Of the speeds what moves and what turns the body as a whole.
void rigid_parts(const MotionBody& body, const MotionState& state, Numbers& moving,
                 Numbers& turning) {
  double mass = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), mean = centre, moment = centre;
  const auto at = [](const Numbers& of, std::size_t i) {
    return Eigen::Vector3d(of[3 * i], of[3 * i + 1], of[3 * i + 2]);
  };
  for (std::size_t i = 0; i < body.masses.size(); ++i) {
    mass += body.masses[i];
    centre += body.masses[i] * at(state.place, i);
    mean += body.masses[i] * at(state.velocity, i);
  }
  centre /= mass;
  mean /= mass;
  fem::Matrix3 inertia = fem::Matrix3::Zero();
  for (std::size_t i = 0; i < body.masses.size(); ++i) {
    const Eigen::Vector3d arm = at(state.place, i) - centre;
    moment += body.masses[i] * arm.cross(at(state.velocity, i) - mean);
    inertia +=
        body.masses[i] * (arm.squaredNorm() * fem::Matrix3::Identity() - arm * arm.transpose());
  }
  const Eigen::Vector3d spin = inertia.ldlt().solve(moment);
  for (std::size_t i = 0; i < body.masses.size(); ++i) {
    const Eigen::Vector3d of_spin = spin.cross(at(state.place, i) - centre);
    for (int k = 0; k < 3; ++k) {
      moving[3 * i + static_cast<std::size_t>(k)] = mean[k];
      turning[3 * i + static_cast<std::size_t>(k)] = of_spin[k];
    }
  }
}

/// What is left without these, and without axes that are held.
Numbers inner_speeds(const MotionBody& body, const MotionState& state) {
  Numbers moving(body.axes()), turning(body.axes());
  if (!state.any_held())
    rigid_parts(body, state, moving, turning);
  Numbers inner = state.velocity;
  for (std::size_t axis = 0; axis < body.axes(); ++axis)
    if (state.held[axis] != 0)
      inner[axis] = 0;
  add(inner, -1, moving);
  add(inner, -1, turning);
  return inner;
}

} // namespace

double inner_energy(const MotionBody& body, const MotionState& state) {
  return motion_energy(body, inner_speeds(body, state));
}

void slow_inner(const MotionBody& body, MotionState& state, double factor) {
  add(state.velocity, factor - 1, inner_speeds(body, state));
}

bool limit_energy(const MotionBody& body, MotionState& state, double elastic, double before,
                  double rounding) {
  const double kinetic_now = motion_energy(body, state.velocity),
               excess =
                   kinetic_now + elastic - work_of_load(body, state.load, state.place) - before;
  if (!(excess > rounding))
    return false;
  Numbers moving(body.axes()), turning(body.axes());
  if (!state.any_held())
    rigid_parts(body, state, moving, turning);
  Numbers inner = state.velocity, held(body.axes());
  for (std::size_t axis = 0; axis < body.axes(); ++axis)
    if (state.held[axis] != 0)
      held[axis] = std::exchange(inner[axis], 0);
  add(inner, -1, moving);
  add(inner, -1, turning);
  const double inner_energy = motion_energy(body, inner),
               turning_energy = motion_energy(body, turning);
  const auto take = [&](double energy, double& left) { // the factor that takes so much of it
    const double taken = std::min(energy, left);
    left -= taken;
    return energy > 0 ? std::sqrt(std::max(0.0, 1 - taken / energy)) : 0;
  };
  double left = excess;
  const double of_inner = take(inner_energy, left), of_turning = take(turning_energy, left),
               of_body = take(motion_energy(body, moving), left);
  for (std::size_t axis = 0; axis < body.axes(); ++axis)
    state.velocity[axis] =
        of_inner * inner[axis] + of_turning * turning[axis] + of_body * moving[axis] + held[axis];
  return true;
}

} // namespace gewebe::integrator
