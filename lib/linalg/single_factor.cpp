#include "linalg/single_factor.h"

#include "base/parallel.h"
#include "linalg/single_factor_internal.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gewebe::linalg {

namespace {

constexpr std::uint32_t none = UINT32_MAX;
/// Of all entries, that a branch of each level has at most with all that ends in it: first enough
/// of them for some threads, then what is left of each half, then the rest.
constexpr std::array<double, 4> parts = {0.06, 0.25, 0.6, HUGE_VAL};
constexpr std::size_t worth_threads = 1U << 20; // entries
constexpr double most = INT16_MAX;

} // namespace

SingleFactor::SingleFactor(const Factor& factor) {
  const FactorView v = factor.view();
  const std::size_t count = v.super.size() - 1;
  for (const std::int64_t p : v.permutation)
    permutation_.push_back(static_cast<std::uint32_t>(p));
  x_.resize(order());
  std::vector<std::size_t> value_start, square_start;
  for (std::size_t k = 0; k < count; ++k) {
    const auto first = static_cast<std::size_t>(v.super[k]),
               columns = static_cast<std::size_t>(v.super[k + 1]) - first,
               rows = static_cast<std::size_t>(v.pi[k + 1] - v.pi[k]);
    value_start.push_back(values_.size());
    square_start.push_back(squares_.size());
    fronts_.push_back({nullptr, nullptr, rows, columns});
    copy_front(fronts_.back(), v.x.data() + v.px[k]);
    first_.push_back(first);
    start_.push_back(row_.size());
    for (std::size_t r = columns; r < rows; ++r)
      row_.push_back(static_cast<std::uint32_t>(v.s[static_cast<std::size_t>(v.pi[k]) + r]));
  }
  start_.push_back(row_.size());
  for (std::size_t k = 0; k < count; ++k) {
    fronts_[k].l = values_.data() + value_start[k];
    fronts_[k].squares = squares_.data() + square_start[k];
  }
  make_branches();
}

/// The panels of a front, whose entry (r, c) is l[c · rows + r].
void SingleFactor::copy_front(SingleFront& f, const double* l) {
  const auto entry = [&](std::size_t r, std::size_t c) { return l[c * f.rows + r]; };
  for (std::size_t c = 0; c < f.columns; c += f.width(c)) {
    const std::size_t width = f.width(c), own = f.own(c), steps = f.steps(c), first = c + own;
    // Its square's inverse, column by column.
    std::vector<double> inverse(width * width);
    for (std::size_t k = 0; k < own; ++k)
      for (std::size_t r = k; r < own; ++r) {
        double sum = r == k ? 1 : 0;
        for (std::size_t m = k; m < r; ++m)
          sum -= entry(c + r, c + m) * inverse[k * width + m];
        inverse[k * width + r] = sum / entry(c + r, c + r);
      }
    for (std::size_t k = 0; k < width * width; ++k)
      squares_.push_back(static_cast<float>(inverse[k]));
    for (std::size_t k = 0; k < width * width; ++k)
      squares_.push_back(static_cast<float>(inverse[k % width * width + k / width]));
    const std::size_t at = values_.size();
    values_.resize(at + SingleFront::step * width * steps);
    for (std::size_t k = 0; k < width; ++k) {
      double largest = 0;
      for (std::size_t r = first; k < own && r < f.rows; ++r)
        largest = std::max(largest, std::abs(entry(r, c + k)));
      const auto scale = static_cast<float>(largest / most);
      squares_.push_back(scale);
      for (std::size_t r = first; scale > 0 && r < f.rows; ++r)
        values_[at + ((r - first) / SingleFront::step * width + k) * SingleFront::step +
                (r - first) % SingleFront::step] =
            static_cast<std::int16_t>(
                std::lround(std::clamp(entry(r, c + k) / static_cast<double>(scale), -most, most)));
    }
  }
}

void SingleFactor::make_branches() {
  const std::size_t count = fronts_.size();
  std::vector<std::uint32_t> front_of(order()), parent(count, none);
  for (std::uint32_t k = 0; k < count; ++k)
    std::fill_n(front_of.begin() + static_cast<std::ptrdiff_t>(first_[k]), fronts_[k].columns, k);
  std::vector<double> size(count);
  double all = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    const auto own = static_cast<double>(fronts_[k].rows * fronts_[k].columns);
    size[k] += own;
    all += own;
    if (!rows_below(k).empty()) {
      parent[k] = front_of[rows_below(k).front()];
      size[parent[k]] += size[k];
    }
  }
  levels_.resize(parts.size());
  std::vector<std::size_t> level(count);
  std::vector<std::uint32_t> branch(count);
  for (std::uint32_t k = static_cast<std::uint32_t>(count); k-- > 0;) {
    while (size[k] > parts[level[k]] * all)
      ++level[k];
    if (parent[k] != none && level[parent[k]] == level[k]) {
      branch[k] = branch[parent[k]];
      continue;
    }
    branch[k] = static_cast<std::uint32_t>(branches_.size());
    branches_.emplace_back();
    levels_[level[k]].push_back(branch[k]);
    if (parent[k] != none)
      branches_[branch[parent[k]]].branches.push_back(branch[k]);
  }
  for (std::uint32_t k = 0; k < count; ++k)
    branches_[branch[k]].fronts.push_back(k);
  for (Branch& b : branches_)
    b.sums.resize(order() - first(b));
}

void SingleFactor::forward(Branch& branch, const SingleKernel& kernel) {
  const std::uint32_t root = branch.fronts.back();
  float* const sums = branch.sums.data() - first(branch);
  std::fill(sums + first(branch), sums + first_[root] + fronts_[root].columns, 0.0F);
  for (const std::uint32_t row : rows_below(root))
    sums[row] = 0;
  for (const std::uint32_t n : branch.branches) {
    const Branch& before = branches_[n];
    for (const std::uint32_t row : rows_below(before.fronts.back()))
      sums[row] += before.sums[row - first(before)];
  }
  std::vector<float> rows;
  for (const std::uint32_t k : branch.fronts) {
    const SingleFront& f = fronts_[k];
    rows.assign(f.rows + SingleFront::step, 0.0F);
    for (std::size_t r = 0; r < f.columns; ++r)
      rows[r] = x_[first_[k] + r] + sums[first_[k] + r];
    kernel.forward(f, rows.data());
    std::copy_n(rows.begin(), f.columns, x_.begin() + static_cast<std::ptrdiff_t>(first_[k]));
    const std::span below = rows_below(k);
    for (std::size_t r = 0; r < below.size(); ++r)
      sums[below[r]] += rows[f.columns + r];
  }
}

void SingleFactor::backward(const Branch& branch, const SingleKernel& kernel) {
  std::vector<float> rows;
  for (std::size_t n = branch.fronts.size(); n-- > 0;) {
    const std::uint32_t k = branch.fronts[n];
    const SingleFront& f = fronts_[k];
    const std::span below = rows_below(k);
    rows.assign(f.rows + SingleFront::step, 0.0F);
    const auto own = x_.begin() + static_cast<std::ptrdiff_t>(first_[k]);
    std::copy_n(own, f.columns, rows.begin());
    for (std::size_t r = 0; r < below.size(); ++r)
      rows[f.columns + r] = x_[below[r]];
    kernel.backward(f, rows.data());
    std::copy_n(rows.begin(), f.columns, own);
  }
}

void SingleFactor::solve(std::span<double> x, const Context& context) {
  const SingleKernel& kernel = single_kernel(context.cpu);
  for (std::size_t k = 0; k < x_.size(); ++k)
    x_[k] = static_cast<float>(x[permutation_[k]]);
  const auto together = [&](const std::vector<std::uint32_t>& level, const auto& work) {
    if (level.size() > 1 && values_.size() >= gewebe::linalg::worth_threads &&
        gewebe::thread_count(context) > 1)
      gewebe::parallel_blocks(context, level.size(), 1,
                              [&](std::size_t n, std::size_t) { work(branches_[level[n]]); });
    else
      for (const std::uint32_t n : level)
        work(branches_[n]);
  };
  for (const std::vector<std::uint32_t>& level : levels_)
    together(level, [&](Branch& branch) { forward(branch, kernel); });
  for (std::size_t n = levels_.size(); n-- > 0;)
    together(levels_[n], [&](const Branch& branch) { backward(branch, kernel); });
  for (std::size_t k = 0; k < x_.size(); ++k)
    x[permutation_[k]] = static_cast<double>(x_[k]);
}

} // namespace gewebe::linalg
