#pragma once
// A block of a matrix as a sum of few crosses scale u vᵀ, whose numbers are small integers.
//
// Greedy: the largest entry of what is still missing starts a cross, power steps turn it towards
// the dominant one, it is rounded, and what is missing is computed anew with the rounded cross. So
// errors of rounding are met by later crosses, and the work ends when every entry is within the
// bound: that is checked, not estimated. Crosses of which a 127th is below the bound are of int8,
// others of int16.
//
// A symmetric block, such as that of a cluster with itself, is no sum of few crosses: it is kept as
// the integers of its lower triangle, row by row, as int8 or int16 or, with a scale each, as both.

#include "base/cpu.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// Crosses of several blocks, one block behind the other; of each those of int16 first.
struct Crosses {
  std::vector<double> scale;       ///< of each cross
  std::vector<std::int16_t> wide;  ///< u, then v, of one cross behind the other
  std::vector<std::int8_t> narrow; ///< the same of those of int8
};

/// How many crosses a block has, or how often its triangle stands there.
struct CrossCount {
  std::uint32_t wide = 0, narrow = 0;

  bool operator==(const CrossCount&) const = default;
};

/// Takes a block of `rows` by rest.size() / rows numbers, row by row, which it uses up, and appends
/// its crosses, or with `symmetric` its triangle. A row or column of zeros has zeros. The same
/// bytes at every level of CPU. \pre bound > 0   \throw Error if a number isn't finite, or
/// exceeds 1.6e7 bounds in a triangle
CrossCount append_crosses(std::span<double> rest, std::size_t rows, bool symmetric, double bound,
                          CpuLevel cpu, Crosses& to);

/// Crosses of one block where they lie.
struct CrossView {
  std::size_t rows = 0, columns = 0;
  bool symmetric = false;
  CrossCount count;
  const double* scale = nullptr;
  const std::int16_t* wide = nullptr;
  const std::int8_t* narrow = nullptr;

  /// Numbers of a cross, or of a triangle.
  std::size_t stride() const { return symmetric ? rows * (rows + 1) / 2 : rows + columns; }
};

/// A number of a vector.
struct CrossLoad {
  std::size_t at = 0;
  double value = 0;
};

/// Adds the sum of scale u[row + r] v[column + c] over the crosses to to[size r + c], for r, c <
/// size.
void add_entries(const CrossView& block, std::size_t row, std::size_t column, std::size_t size,
                 double* to);

/// y += B x, or Bᵀ x with `transposed`, for a vector x of few numbers.
/// \pre y.size() is the number of rows, or of columns
void add_product(const CrossView& block, bool transposed, std::span<const CrossLoad> x,
                 CpuLevel cpu, std::span<double> y);

} // namespace gewebe
