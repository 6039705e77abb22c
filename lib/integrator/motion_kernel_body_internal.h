#pragma once
// The body of motion_kernel_*.cpp; each of these files compiles it for one instruction set.

#include "integrator/motion_kernel_internal.h"
#include "numeric/four_lanes.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace gewebe::integrator {
namespace {

// Loops over a whole batch have a length that compilers know, so that they take several at a time.
inline void pull(const SpringColumns& springs, const double* at, double per_time, double* forces,
                 SpringEnergies& energies) {
  constexpr std::size_t batch = SpringColumns::batch;
  std::array<double, batch> x, y, z, by, elastic{}, damped{};
  for (std::size_t first = 0; first < springs.count; first += batch) {
    const std::uint32_t *const i = springs.i + first, *const j = springs.j + first;
    for (std::size_t k = 0; k < batch; ++k) {
      const double *const from = at + 3 * std::size_t{i[k]}, *const to = at + 3 * std::size_t{j[k]};
      x[k] = to[0] - from[0];
      y[k] = to[1] - from[1];
      z[k] = to[2] - from[2];
    }
    const double *const stiffness = springs.stiffness + first,
                        *const damping = springs.damping + first,
                        *const rest = springs.rest + first, *const kept = springs.kept + first;
    double* const lengths = springs.length + first;
    for (std::size_t k = 0; k < batch; ++k) {
      const double length = std::sqrt(x[k] * x[k] + y[k] * y[k] + z[k] * z[k]),
                   off = length - rest[k], grown = length - kept[k],
                   viscous = damping[k] * per_time;
      lengths[k] = length;
      elastic[k] += stiffness[k] * off * off / 2;
      damped[k] += viscous * grown * grown / 2;
      const double over = length == 0 ? 1 : length; // no direction: x, y and z are 0
      by[k] = (stiffness[k] * off + viscous * grown) / over;
    }
    for (std::size_t k = 0; k < batch; ++k) {
      x[k] *= by[k];
      y[k] *= by[k];
      z[k] *= by[k];
    }
    const std::size_t count = springs.count - first < batch ? springs.count - first : batch;
    for (std::size_t k = 0; k < count; ++k) {
      double *const from = forces + 3 * std::size_t{i[k]}, *const to =
                                                               forces + 3 * std::size_t{j[k]};
      from[0] += x[k];
      from[1] += y[k];
      from[2] += z[k];
      to[0] -= x[k];
      to[1] -= y[k];
      to[2] -= z[k];
    }
  }
  for (std::size_t k = 0; k < batch; ++k) {
    energies.elastic += elastic[k];
    energies.damped += damped[k];
  }
}

inline double product(const float* a, const double* b, std::size_t count) {
  numeric::Four sum{}, values;
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4) {
    numeric::load(a + k, values);
    sum += values * numeric::four(b + k);
  }
  for (; k < count; ++k)
    sum[0] += static_cast<double>(a[k]) * b[k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

inline void increase(double* to, double factor, const float* of, std::size_t count) {
  numeric::Four values;
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4) {
    numeric::load(of + k, values);
    numeric::four(to + k) += factor * values;
  }
  for (; k < count; ++k)
    to[k] += factor * static_cast<double>(of[k]);
}

} // namespace
} // namespace gewebe::integrator
