#include "integrator/motion_body_internal.h"

#include <algorithm>

namespace gewebe::integrator {

bool MotionState::any_held() const {
  return std::ranges::any_of(held, [](std::uint8_t h) { return h != 0; });
}

double motion_energy(const MotionBody& body, const Numbers& v) {
  double sum = 0;
  for (std::size_t axis = 0; axis < v.size(); ++axis)
    sum += body.masses[axis / 3] * v[axis] * v[axis];
  return sum / 2;
}

double work_of_load(const MotionBody& body, const Numbers& load, const Numbers& places) {
  double sum = 0;
  for (std::size_t axis = 0; axis < places.size(); ++axis)
    sum += load[axis] * (places[axis] - body.rest[axis]);
  return sum;
}

} // namespace gewebe::integrator
