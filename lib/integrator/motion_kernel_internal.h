#pragma once
// The inner loops of springs and secants of integrator/solid_motion.h. Compiled once per CPU level;
// every level gives the same bits.

#include "base/cpu.h"

#include <cstddef>
#include <cstdint>

namespace gewebe::integrator {

/// Springs by columns, as many as whole batches have: those that fill the last one up are of no
/// stiffness and join node 0 to itself.
struct SpringColumns {
  static constexpr std::size_t batch = 64;

  const std::uint32_t *i = nullptr, *j = nullptr;
  const double *stiffness = nullptr, *damping = nullptr, *rest = nullptr;
  const double* kept = nullptr; ///< lengths from which dampers count
  double* length = nullptr;     ///< is written
  std::size_t count = 0;        ///< without those that fill up
};

struct SpringEnergies {
  double elastic = 0, damped = 0;
};

struct MotionKernel {
  /// What springs between nodes at these places have and take, as MotionSprings has it; what they
  /// pull with is added to the forces. Energies are sums of each 64th, added in order.
  void (*pull)(const SpringColumns& springs, const double* at, double per_time, double* forces,
               SpringEnergies& energies);
  /// As product() of integrator/motion_numbers_internal.h, to the bit.
  double (*product)(const float* a, const double* b, std::size_t count);
  /// to += factor · of
  void (*increase)(double* to, double factor, const float* of, std::size_t count);
};

extern const MotionKernel motion_kernel_baseline, motion_kernel_avx2;

inline const MotionKernel& motion_kernel(CpuLevel level) {
  return level == CpuLevel::baseline ? motion_kernel_baseline : motion_kernel_avx2;
}

} // namespace gewebe::integrator
