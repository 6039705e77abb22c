#pragma once
// The inner loops of solve/single_factor.h. Compiled once per CPU level; every level gives the same
// bits.

#include "base/cpu.h"
#include "solve/single_factor.h"

namespace gewebe {

struct SingleKernel {
  /// own = L⁻¹ own of the front's own rows; the rows below lose what that contributes.
  void (*forward)(const SingleFront& front, float* own, float* below);
  /// own = L⁻ᵀ (own - what the rows below contribute).
  void (*backward)(const SingleFront& front, float* own, const float* below);
};

extern const SingleKernel single_kernel_baseline, single_kernel_avx2;

inline const SingleKernel& single_kernel(CpuLevel level) {
  return level == CpuLevel::baseline ? single_kernel_baseline : single_kernel_avx2;
}

} // namespace gewebe
