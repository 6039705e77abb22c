#pragma once
// The inner loops of linalg/single_factor.h. Compiled once per CPU level; every level gives the
// same bits.

#include "base/cpu.h"
#include "linalg/single_factor.h"

namespace gewebe::linalg {

/// Of a front's rows, its own first, with SingleFront::step numbers behind them that are there to
/// be read and written.
struct SingleKernel {
  /// Its own rows become L⁻¹ of them; those below lose what that contributes.
  void (*forward)(const SingleFront& front, float* rows);
  /// Its own rows become L⁻ᵀ of them less what those below contribute. \pre the numbers behind are
  /// 0
  void (*backward)(const SingleFront& front, float* rows);
};

extern const SingleKernel single_kernel_baseline, single_kernel_avx2;

inline const SingleKernel& single_kernel(CpuLevel level) {
  return level == CpuLevel::baseline ? single_kernel_baseline : single_kernel_avx2;
}

} // namespace gewebe::linalg
