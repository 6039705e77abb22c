#pragma once
// Low-rank approximation of a block of a matrix by few quantised rank-one terms ("crosses"): each
// is scale u vᵀ, where u and v are small integers.
//
// Greedy algorithm: the largest entry of the remainder starts a term. Power iterations turn the
// term towards the dominant one. The term is rounded, and the remainder is computed with the
// rounded term, so that later terms correct the rounding. It ends when every entry of the remainder
// is within the bound: this is checked, not estimated. Terms whose 127th part is below the bound
// are of int8, others of int16.
//
// A symmetric block, such as that of a cluster with itself, is no sum of few terms. It is stored as
// the integers of its lower triangle, row by row, as int8 or int16 or, with a scale each, as both.

#include "base/cpu.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::columns {

/// Terms of several blocks, block by block; within a block those of int16 first.
struct Crosses {
  std::vector<double> scale;       ///< of each term
  std::vector<std::int16_t> wide;  ///< u, then v, term by term
  std::vector<std::int8_t> narrow; ///< the same for terms of int8
};

/// Number of terms of a block, or of copies of its triangle.
struct CrossCount {
  std::uint32_t wide = 0, narrow = 0;

  bool operator==(const CrossCount&) const = default;
};

/// Appends the terms of a block, or with `symmetric` its triangle. A row or column of zeros stays
/// zero. The result is the same bytes at every level of CPU.
/// \param rest  `rows` by rest.size() / rows numbers, row by row; overwritten by the remainder
/// \pre bound > 0
/// \throw Error if a number isn't finite, or exceeds 1.6e7 bounds in a triangle
CrossCount append_crosses(std::span<double> rest, std::size_t rows, bool symmetric, double bound,
                          CpuLevel cpu, Crosses& to);

/// View of the terms of one block in Crosses.
struct CrossView {
  std::size_t rows = 0, columns = 0;
  bool symmetric = false;
  CrossCount count;
  const double* scale = nullptr;
  const std::int16_t* wide = nullptr;
  const std::int8_t* narrow = nullptr;

  /// Count of numbers of a term, or of a triangle.
  std::size_t stride() const { return symmetric ? rows * (rows + 1) / 2 : rows + columns; }
};

/// Entry of a sparse vector.
struct CrossLoad {
  std::size_t at = 0;
  double value = 0;
};

/// Adds the sum of scale u[row + r] v[column + c] over the terms to to[size r + c], for r, c <
/// size.
void add_entries(const CrossView& block, std::size_t row, std::size_t column, std::size_t size,
                 double* to);

/// Largest |u| and |v| of each term. \pre not symmetric
std::vector<std::array<double, 2>> largest_entries(const CrossView& block);

/// Bound of |B x|, or of |Bᵀ x| with `transposed`, along any axis: the sum of those of the terms.
/// \param largest  of the terms   \pre not symmetric
double product_bound(const CrossView& block, bool transposed, std::span<const CrossLoad> x,
                     std::span<const std::array<double, 2>> largest);

/// y += B x, or Bᵀ x with `transposed`, for a sparse vector x.
/// \pre y.size() is the number of rows, or of columns
void add_product(const CrossView& block, bool transposed, std::span<const CrossLoad> x,
                 CpuLevel cpu, std::span<double> y);

} // namespace gewebe::columns
