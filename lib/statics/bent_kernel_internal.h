#pragma once
// Small dense systems, as parts of a contact have them: some dozens of rows, for which a general
// library's packing and blocking take longer than the numbers do. Matrices are by columns, without
// gaps. Compiled once per CPU level; every level gives the same bits, for no multiplication is
// fused and no order of a sum depends on the level.
//
// Orders of sums are those of Eigen's PartialPivLU and matrix products on two lanes, which take
// over where systems are larger: results don't change with who computes them.

#include "base/cpu.h"

#include <cstddef>
#include <cstdint>

namespace gewebe {

/// Systems of so many rows or more are Eigen's.
inline constexpr std::size_t bent_kernel_rows = 128;

struct BentKernel {
  /// P A = L U in place, L of unit diagonal. \param swapped row k was swapped with, n numbers
  /// \pre n < bent_kernel_rows
  void (*factor)(double* a, std::size_t n, std::uint32_t* swapped);
  /// A⁻¹ of columns, in place. \param lu, swapped by factor
  void (*solve)(const double* lu, const std::uint32_t* swapped, std::size_t n, double* columns,
                std::size_t count);
  /// to = A B. \param a of rows times depth \param b of depth times columns
  /// \pre depth < bent_kernel_rows
  void (*multiply)(const double* a, std::size_t rows, std::size_t depth, const double* b,
                   std::size_t columns, double* to);
  /// to = W H, of columns of W alone: rows that are 0 in all three columns of a node cost nothing.
  /// \param w of `rows` rows \param turning which n of its columns \param h n² numbers
  /// \pre n < bent_kernel_rows
  void (*spread)(const double* w, std::size_t rows, const std::ptrdiff_t* turning, std::size_t n,
                 const double* h, double* to);
  /// to = W v, of columns whose v is not 0. \pre columns < bent_kernel_rows
  void (*times)(const double* w, std::size_t rows, std::size_t columns, const double* v,
                double* to);
  /// to = Σ weight_c W_c n: where a force along n moves what it pushes by its weights at up to
  /// three nodes. \param w the three columns of each node, the first \param along n
  void (*push)(const double* const* w, const double* weight, std::size_t count, std::size_t rows,
               const double* along, double* to);
  /// to = n·Σ weight_c x_c: how far a point of up to three nodes is moved along n, in so many
  /// cases. \param x how far each node is along the first axis, behind it along the others: of each
  /// case
  void (*read)(const double* const* x, const double* weight, std::size_t count, std::size_t cases,
               const double* along, double* to);
};

extern const BentKernel bent_kernel_baseline, bent_kernel_avx2;

inline const BentKernel& bent_kernel(CpuLevel level) {
  return level == CpuLevel::baseline ? bent_kernel_baseline : bent_kernel_avx2;
}

} // namespace gewebe
