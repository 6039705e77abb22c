#include "cholesky/block_cholesky.h"

#include "cholesky/front_kernel_internal.h"
#include "cholesky/front_layout.h"

#include <algorithm>
#include <numeric>
#include <utility>

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
void BlockCholesky::order_groups(std::span<const std::uint8_t> coupled) {
  const std::size_t count = unknowns_.size();
  std::size_t groups = count; // of the table
  while (groups * groups < coupled.size())
    ++groups;
  std::vector<std::uint8_t> near(count * count), left(count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < count; ++j)
      near[i * count + j] = i != j && coupled[i * groups + j] != 0 ? 1 : 0;
  for (std::size_t i = 0; i < count; ++i)
    left[i] = unknowns_[i].empty() ? 0 : 1;
  for (;;) {
    std::uint32_t least = 0;
    std::size_t rows = SIZE_MAX;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (left[i] == 0)
        continue;
      std::size_t own = unknowns_[i].size();
      for (std::size_t j = 0; j < count; ++j)
        if (left[j] != 0 && near[i * count + j] != 0)
          own += unknowns_[j].size();
      if (own < rows) {
        rows = own;
        least = i;
      }
    }
    if (rows == SIZE_MAX)
      return;
    fronts_.resize(std::max(fronts_.size(), used_ + 1));
    Front& front = fronts_[used_];
    front.groups = {least};
    front_of_[least] = static_cast<std::uint32_t>(used_++);
    left[least] = 0;
    for (std::uint32_t j = 0; j < count; ++j) {
      if (left[j] == 0 || near[least * count + j] == 0)
        continue;
      front.groups.push_back(j);
      for (std::size_t k = 0; k < count; ++k) // fill
        if (k != j && left[k] != 0 && near[least * count + k] != 0)
          near[j * count + k] = 1;
    }
  }
}

void BlockCholesky::begin(std::span<const std::uint32_t> group,
                          std::span<const std::uint8_t> coupled) {
  group_.assign(group.begin(), group.end());
  local_.clear();
  for (std::vector<std::uint32_t>& of : unknowns_)
    of.clear();
  const std::size_t count = group.empty() ? 0 : std::size_t{std::ranges::max(group)} + 1;
  unknowns_.resize(count);
  for (std::uint32_t u = 0; u < group.size(); ++u) {
    local_.push_back(static_cast<std::uint32_t>(unknowns_[group[u]].size()));
    unknowns_[group[u]].push_back(u);
  }
  used_ = 0;
  front_of_.assign(count, 0);
  order_groups(coupled);
  row_of_.assign(used_ * count, 0);
  for (std::size_t k = 0; k < used_; ++k) {
    Front& front = fronts_[k];
    std::ranges::sort(front.groups, {}, [&](std::uint32_t g) { return front_of_[g]; });
    front.rows.clear();
    for (const std::uint32_t g : front.groups) {
      row_of(k, g) = front.rows.size();
      front.rows.insert(front.rows.end(), unknowns_[g].begin(), unknowns_[g].end());
    }
    front.columns = unknowns_[front.groups[0]].size();
    front.l.assign(front_offset(front.rows.size(), front.columns), 0);
  }
}

void BlockCholesky::add_block(std::span<const std::uint32_t> unknowns,
                              std::span<const double> block) {
  const std::size_t order = unknowns.size();
  std::vector<std::size_t> by_elimination(order), row(order);
  std::iota(by_elimination.begin(), by_elimination.end(), std::size_t{0});
  std::ranges::sort(by_elimination, {}, [&](std::size_t i) {
    return std::pair(front_of_[group_[unknowns[i]]], local_[unknowns[i]]);
  });
  std::uint32_t last = UINT32_MAX;
  for (std::size_t j = 0; j < order; ++j) {
    const std::uint32_t u = unknowns[by_elimination[j]], front = front_of_[group_[u]];
    for (std::size_t i = j; i < order && front != last; ++i) {
      const std::uint32_t v = unknowns[by_elimination[i]];
      row[i] = row_of(front, group_[v]) + local_[v];
    }
    last = front;
    const double* const source = block.data() + by_elimination[j] * order;
    double* const target = column(fronts_[front], local_[u]);
    for (std::size_t i = j; i < order; ++i)
      target[row[i]] += source[by_elimination[i]];
  }
}

/// Adds what the elimination of a front changes in those behind it: columns of two groups stand one
/// behind the other in both.
void BlockCholesky::add_update(std::size_t from, std::span<double> update) {
  Front& front = fronts_[from];
  const FrontArrays arrays{front.rows.size(), front.columns, front.l.data(), update.data()};
  for (std::size_t i = 1; i < front.groups.size(); ++i) {
    const std::uint32_t own = front.groups[i];
    const std::size_t to = front_of_[own], first = row_of(from, own);
    for (std::size_t c = 0; c < unknowns_[own].size(); ++c) {
      const double* const source = arrays.column(first + c);
      double* const target = column(fronts_[to], c);
      for (std::size_t j = i; j < front.groups.size(); ++j) {
        const std::uint32_t other = front.groups[j];
        const std::size_t at = row_of(from, other), there = row_of(to, other);
        for (std::size_t r = j == i ? c : 0; r < unknowns_[other].size(); ++r)
          target[there + r] += source[at + r];
      }
    }
  }
}

bool BlockCholesky::factor(CpuLevel cpu) {
  const FrontKernel& kernel = kernel_of(cpu);
  for (std::size_t k = 0; k < used_; ++k) {
    Front& front = fronts_[k];
    const std::size_t below = front.rows.size() - front.columns;
    update_.assign(below * (below + 1) / 2, 0);
    if (!eliminate({front.rows.size(), front.columns, front.l.data(), update_.data()}, kernel,
                   square_, strips_, least_))
      return false;
    add_update(k, update_);
  }
  return true;
}

void BlockCholesky::solve(std::span<double> x) {
  const std::size_t order = group_.size(), count = order > 0 ? x.size() / order : 0;
  const auto gather = [&](const Front& front) {
    part_.resize(count * front.rows.size());
    double* to = part_.data();
    for (std::size_t k = 0; k < count; ++k)
      for (const std::uint32_t row : front.rows)
        *to++ = x[k * order + row];
  };
  for (std::size_t f = 0; f < used_; ++f) {
    Front& front = fronts_[f];
    const std::size_t rows = front.rows.size();
    gather(front);
    for (std::size_t c = 0; c < front.columns; ++c) {
      const double* const l = column(front, c);
      for (double* part = part_.data(); part < part_.data() + count * rows; part += rows) {
        const double value = part[c] /= l[c];
        for (std::size_t r = c + 1; r < rows; ++r)
          part[r] -= l[r] * value;
      }
    }
    for (std::size_t k = 0; k < count; ++k)
      for (std::size_t r = 0; r < rows; ++r)
        x[k * order + front.rows[r]] = part_[k * rows + r];
  }
  for (std::size_t f = used_; f-- > 0;) {
    Front& front = fronts_[f];
    const std::size_t rows = front.rows.size();
    gather(front);
    for (std::size_t c = front.columns; c-- > 0;) {
      const double* const l = column(front, c);
      for (std::size_t k = 0; k < count; ++k) {
        double* const part = part_.data() + k * rows;
        double sums[4] = {0, 0, 0, 0}; // side by side: one behind the other waits for each addition
        std::size_t r = c + 1;
        for (; r + 4 <= rows; r += 4)
          for (std::size_t i = 0; i < 4; ++i)
            sums[i] += l[r + i] * part[r + i];
        double sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
        for (; r < rows; ++r)
          sum += l[r] * part[r];
        x[k * order + front.rows[c]] = part[c] = (part[c] - sum) / l[c];
      }
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
