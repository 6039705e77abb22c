#pragma once
// Dense kernel of the multifrontal Cholesky factorisation: factors the columns that a front
// eliminates, and computes its update matrix. It is compiled once per CPU level. Every level gives
// the same bits, whatever the size of blocks: products are subtracted from an entry one by one, in
// the order of elimination, by fused operations.

#include "cholesky/front_layout.h"

#include <cstddef>
#include <span>

namespace gewebe::cholesky {

/// A front by columns: `columns` of L (see front_offset), and the lower triangle of the update
/// matrix of `below` = rows - columns, packed: a column begins at its diagonal, right behind the
/// one before. What is above the diagonal in `l` is not written to.
struct FrontArrays {
  std::size_t rows = 0, columns = 0;
  double* l = nullptr;
  double* update = nullptr;

  std::size_t below() const { return rows - columns; }
  /// The block of L that begins with this column, by columns of `rows` - begin numbers.
  double* block(std::size_t begin) const { return l + front_offset(rows, begin); }
  /// Column c such that [r] is its entry in row r of the front, r >= c.
  double* column(std::size_t c) const {
    if (c < columns)
      return front_column(l, rows, c);
    // The packed column k begins k (k - 1) / 2 numbers before where that of a square would.
    const std::size_t k = c - columns;
    return update + (k * below() - k * (k + 1) / 2) - columns;
  }
};

/// What a block of columns needs beside the front: its square on the diagonal with the reciprocals
/// of its pivots, and copies of the rows below, by strips that end with the last row.
struct FrontScratch {
  double* square = nullptr; ///< square_size(front_block) numbers
  double* strips = nullptr; ///< strips_size(rows of the front, count)
};

/// Rows of a child's update matrix that stand one behind the other in the parent too.
struct FrontRun {
  std::size_t begin = 0, end = 0;
  std::size_t to = 0; ///< where the first stands
};

/// A child's update matrix, packed as that of a front, and where all of its rows go, ascending.
struct FrontGain {
  const double* update = nullptr;
  std::size_t below = 0;
  std::span<const FrontRun> runs;
};

struct FrontKernel {
  std::size_t strip; ///< rows of one
  std::size_t (*square_size)(std::size_t count);
  /// Columns [first, last) of the front gain a child's. Different ones may be done at once.
  void (*add)(const FrontArrays& front, const FrontGain& gain, std::size_t first, std::size_t last);
  /// Cholesky of the square of columns [begin, begin + count), a block of L, on the diagonal.
  /// Pivots must exceed `least[column]`. \return how many columns were eliminated: fewer than
  /// count, and nothing is to be used, where a pivot did not
  std::size_t (*eliminate)(const FrontArrays& front, std::size_t begin, std::size_t count,
                           const double* min_pivot, const FrontScratch& scratch);
  /// L of the rows below it, strips [first, last) of strips(rows - begin - count).
  void (*solve)(const FrontArrays& front, std::size_t begin, std::size_t count,
                const FrontScratch& scratch, std::size_t first, std::size_t last);
  /// Takes the products of these columns from those behind them, columns of strips [first, last),
  /// on and below the diagonal. Different strips may be done at once.
  void (*update)(const FrontArrays& front, std::size_t begin, std::size_t count,
                 const FrontScratch& scratch, std::size_t first, std::size_t last);

  std::size_t strips(std::size_t rows) const { return (rows + strip - 1) / strip; }
  std::size_t strips_size(std::size_t rows, std::size_t count) const {
    return (rows + strip) * count;
  }
};

extern const FrontKernel front_kernel_baseline;
extern const FrontKernel front_kernel_avx2;
extern const FrontKernel front_kernel_avx512;

} // namespace gewebe::cholesky
