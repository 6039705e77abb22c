#include "solve/dense_cholesky.h"

#include "solve/front_kernel_internal.h"
#include "solve/front_layout.h"

#include <algorithm>

namespace gewebe {

namespace {

const FrontKernel& kernel_of(CpuLevel cpu) {
  if (cpu == CpuLevel::avx512)
    return front_kernel_avx512;
  return cpu == CpuLevel::baseline ? front_kernel_baseline : front_kernel_avx2;
}

/// Eliminates the columns of a front. \return whether all pivots are positive
bool eliminate(const FrontArrays& front, const FrontKernel& kernel, std::vector<double>& square,
               std::vector<double>& strips, std::vector<double>& least) {
  least.assign(front.columns, 0);
  square.resize(kernel.square_size(front_block));
  strips.resize(kernel.strips_size(front.rows, std::min(front.columns, front_block)));
  const FrontScratch scratch{square.data(), strips.data()};
  for (std::size_t begin = 0; begin < front.columns; begin += front_block) {
    const std::size_t count = std::min(front_block, front.columns - begin);
    if (kernel.eliminate(front, begin, count, least.data(), scratch) < count)
      return false;
    const std::size_t all = kernel.strips(front.rows - begin - count);
    kernel.solve(front, begin, count, scratch, 0, all);
    kernel.update(front, begin, count, scratch, 0, all);
  }
  return true;
}

} // namespace

bool DenseCholesky::factor(std::span<const double> matrix, std::size_t order, CpuLevel cpu) {
  order_ = order;
  if (order == 0)
    return true;
  l_.resize(front_offset(order, order));
  for (std::size_t c = 0; c < order; ++c)
    std::copy_n(matrix.data() + c * order + c, order - c, front_column(l_.data(), order, c) + c);
  return eliminate({order, order, l_.data(), nullptr}, kernel_of(cpu), square_, strips_, least_);
}

void DenseCholesky::solve(std::span<double> x) const {
  double* const l = const_cast<double*>(l_.data()); // NOLINT(cppcoreguidelines-pro-type-const-cast)
  for (std::size_t c = 0; c < order_; ++c) {
    const double* const column = front_column(l, order_, c);
    const double value = x[c] /= column[c];
    for (std::size_t r = c + 1; r < order_; ++r)
      x[r] -= column[r] * value;
  }
  for (std::size_t c = order_; c-- > 0;) {
    const double* const column = front_column(l, order_, c);
    double sums[4] = {0, 0, 0, 0}; // side by side: one behind the other waits for each addition
    std::size_t r = c + 1;
    for (; r + 4 <= order_; r += 4)
      for (std::size_t k = 0; k < 4; ++k)
        sums[k] += column[r + k] * x[r + k];
    double sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
    for (; r < order_; ++r)
      sum += column[r] * x[r];
    x[c] = (x[c] - sum) / column[c];
  }
}

bool invert(std::span<double> matrix, std::size_t order, CpuLevel cpu) {
  if (order == 0)
    return true;
  // Of the matrix (A 1; 1 0) the elimination of A leaves -A^-1.
  const std::size_t rows = 2 * order;
  std::vector<double> l(front_offset(rows, order)), update(order * (order + 1) / 2), square, strips,
      least;
  const FrontArrays front{rows, order, l.data(), update.data()};
  for (std::size_t c = 0; c < order; ++c) {
    double* const column = front.column(c);
    std::copy_n(matrix.data() + c * order + c, order - c, column + c);
    std::fill(column + order, column + rows, 0.0);
    column[order + c] = 1;
  }
  if (!eliminate(front, kernel_of(cpu), square, strips, least))
    return false;
  for (std::size_t c = 0; c < order; ++c) {
    const double* const column = front.column(order + c) + order;
    for (std::size_t r = c; r < order; ++r)
      matrix[c * order + r] = matrix[r * order + c] = -column[r];
  }
  return true;
}

} // namespace gewebe
