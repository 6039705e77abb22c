#include "cholesky/block_cholesky.h"

#include "cholesky/front_kernel_internal.h"
#include "cholesky/front_layout.h"

#include <algorithm>

namespace gewebe::cholesky {

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

/// Fronts of all groups, in the order of their elimination.
void BlockCholesky::order_groups(std::span<const std::uint32_t> group,
                                 std::span<const std::uint8_t> coupled) {
  std::vector<std::vector<std::uint32_t>> unknowns;
  for (std::uint32_t u = 0; u < group.size(); ++u) {
    unknowns.resize(std::max(unknowns.size(), group[u] + std::size_t{1}));
    unknowns[group[u]].push_back(u);
  }
  const std::size_t count = unknowns.size();
  std::size_t groups = count; // of the table
  while (groups * groups < coupled.size())
    ++groups;
  std::vector<std::uint8_t> near(count * count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < count; ++j)
      near[i * count + j] = i != j && coupled[i * groups + j] != 0 ? 1 : 0;
  std::vector<std::uint8_t> left(count);
  for (std::size_t i = 0; i < count; ++i)
    left[i] = unknowns[i].empty() ? 0 : 1;
  used_ = 0;
  for (;;) {
    std::size_t least = count, rows = SIZE_MAX;
    for (std::size_t i = 0; i < count; ++i) {
      if (left[i] == 0)
        continue;
      std::size_t own = unknowns[i].size();
      for (std::size_t j = 0; j < count; ++j)
        if (left[j] != 0 && near[i * count + j] != 0)
          own += unknowns[j].size();
      if (own < rows) {
        rows = own;
        least = i;
      }
    }
    if (least == count)
      return;
    fronts_.resize(std::max(fronts_.size(), used_ + 1));
    Front& front = fronts_[used_++];
    front.rows = unknowns[least];
    front.columns = front.rows.size();
    left[least] = 0;
    for (std::size_t j = 0; j < count; ++j) {
      if (left[j] == 0 || near[least * count + j] == 0)
        continue;
      front.rows.insert(front.rows.end(), unknowns[j].begin(), unknowns[j].end());
      for (std::size_t k = 0; k < count; ++k) // fill
        if (k != j && left[k] != 0 && near[least * count + k] != 0)
          near[j * count + k] = 1;
    }
  }
}

bool BlockCholesky::factor(std::span<double> matrix, std::span<const std::uint32_t> group,
                           std::span<const std::uint8_t> coupled, CpuLevel cpu) {
  order_ = group.size();
  order_groups(group, coupled);
  const FrontKernel& kernel = kernel_of(cpu);
  const auto entry = [&](std::uint32_t r, std::uint32_t c) -> double& {
    return matrix[std::size_t{std::min(r, c)} * order_ + std::max(r, c)];
  };
  for (std::size_t k = 0; k < used_; ++k) {
    Front& front = fronts_[k];
    const std::size_t rows = front.rows.size(), below = rows - front.columns;
    front.l.resize(front_offset(rows, front.columns));
    update_.assign(below * (below + 1) / 2, 0);
    const FrontArrays arrays{rows, front.columns, front.l.data(), update_.data()};
    for (std::size_t c = 0; c < front.columns; ++c) {
      double* const column = arrays.column(c);
      for (std::size_t r = c; r < rows; ++r)
        column[r] = entry(front.rows[r], front.rows[c]);
    }
    if (!eliminate(arrays, kernel, square_, strips_, least_))
      return false;
    for (std::size_t c = front.columns; c < rows; ++c) {
      const double* const column = arrays.column(c);
      for (std::size_t r = c; r < rows; ++r)
        entry(front.rows[r], front.rows[c]) += column[r];
    }
  }
  return true;
}

void BlockCholesky::solve(std::span<double> x) {
  const auto gather = [&](const Front& front) {
    part_.resize(front.rows.size());
    for (std::size_t r = 0; r < front.rows.size(); ++r)
      part_[r] = x[front.rows[r]];
  };
  for (std::size_t k = 0; k < used_; ++k) {
    Front& front = fronts_[k];
    const std::size_t rows = front.rows.size();
    gather(front);
    for (std::size_t c = 0; c < front.columns; ++c) {
      const double* const column = front_column(front.l.data(), rows, c);
      const double value = part_[c] /= column[c];
      for (std::size_t r = c + 1; r < rows; ++r)
        part_[r] -= column[r] * value;
    }
    for (std::size_t r = 0; r < rows; ++r)
      x[front.rows[r]] = part_[r];
  }
  for (std::size_t k = used_; k-- > 0;) {
    Front& front = fronts_[k];
    const std::size_t rows = front.rows.size();
    gather(front);
    for (std::size_t c = front.columns; c-- > 0;) {
      const double* const column = front_column(front.l.data(), rows, c);
      double sums[4] = {0, 0, 0, 0}; // side by side: one behind the other waits for each addition
      std::size_t r = c + 1;
      for (; r + 4 <= rows; r += 4)
        for (std::size_t i = 0; i < 4; ++i)
          sums[i] += column[r + i] * part_[r + i];
      double sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
      for (; r < rows; ++r)
        sum += column[r] * part_[r];
      part_[c] = (part_[c] - sum) / column[c];
      x[front.rows[c]] = part_[c];
    }
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

} // namespace gewebe::cholesky
