#pragma once
// The dense part of a front: Cholesky of what it eliminates, and what that takes from the rest.
// Once per CPU level; every level gives the same bits, for each entry loses its products one by one
// in the order of elimination, without fused multiplication.

#include <cstddef>
#include <vector>

namespace gewebe {

/// Columns that are eliminated together, and rows that are worked on together.
inline constexpr std::size_t front_panel = 32, front_strip = 8;

/// A front by columns: `columns` of `rows` numbers, and behind them the lower triangle of what is
/// left, `rows - columns` columns of as many numbers. Of entries right of the diagonal those within
/// a strip may be written to, as numbers that mean nothing.
struct FrontArrays {
  std::size_t rows = 0, columns = 0;
  double* l = nullptr;
  double* rest = nullptr;
};

/// Eliminates the columns [begin, begin + count), count <= front_panel, that earlier ones were
/// taken from: L of them in place, and copies of the rows below in `packed`, by strips. Pivots must
/// exceed `least[column]`. \return how many columns were eliminated: fewer than count, and nothing
/// is to be used, where a pivot did not
struct FrontKernel {
  std::size_t (*eliminate)(const FrontArrays& front, std::size_t begin, std::size_t count,
                           const double* least, double* packed);
  /// Takes the products of those `count` columns from strip `strip` of the columns behind them, all
  /// its rows on and below the diagonal. Different strips may be done at once.
  void (*take)(const FrontArrays& front, std::size_t begin, std::size_t count, const double* packed,
               std::size_t strip);
};

extern const FrontKernel front_kernel_baseline;
extern const FrontKernel front_kernel_avx2;

} // namespace gewebe
