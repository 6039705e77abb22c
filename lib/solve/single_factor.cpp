#include "solve/single_factor.h"

#include "base/parallel.h"
#include "solve/single_factor_internal.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gewebe {

namespace {

constexpr std::uint32_t none = UINT32_MAX;
/// Of all entries, that a branch of each level has at most with all that ends in it: first enough
/// of them for some threads, then what is left of each half, then the rest.
constexpr std::array<double, 4> parts = {0.06, 0.25, 0.6, HUGE_VAL};
constexpr std::size_t worth_threads = 1U << 18; // entries
constexpr double most = INT16_MAX;

} // namespace

SingleFactor::SingleFactor(const Factor& factor) {
  const FactorView v = factor.view();
  const std::size_t count = v.super.size() - 1;
  for (const std::int64_t p : v.permutation)
    permutation_.push_back(static_cast<std::uint32_t>(p));
  x_.resize(order());
  copy_values(v);
  for (std::size_t k = 0; k < count; ++k) {
    const auto first = static_cast<std::size_t>(v.super[k]),
               columns = static_cast<std::size_t>(v.super[k + 1]) - first,
               rows = static_cast<std::size_t>(v.pi[k + 1] - v.pi[k]);
    fronts_.push_back(
        {values_.data() + v.px[k], scale_.data() + first, inverse_.data() + first, rows, columns});
    first_.push_back(first);
    start_.push_back(row_.size());
    for (std::size_t r = columns; r < rows; ++r)
      row_.push_back(static_cast<std::uint32_t>(v.s[static_cast<std::size_t>(v.pi[k]) + r]));
  }
  start_.push_back(row_.size());
  make_branches();
}

void SingleFactor::copy_values(const FactorView& v) {
  values_.resize(v.x.size());
  for (std::size_t k = 0; k + 1 < v.super.size(); ++k) {
    const auto columns = static_cast<std::size_t>(v.super[k + 1] - v.super[k]),
               rows = static_cast<std::size_t>(v.pi[k + 1] - v.pi[k]);
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t at = static_cast<std::size_t>(v.px[k]) + c * rows;
      const std::span below = v.x.subspan(at + c + 1, rows - c - 1);
      double largest = 0;
      for (const double l : below)
        largest = std::max(largest, std::abs(l));
      const auto scale = static_cast<float>(largest / most);
      scale_.push_back(scale);
      inverse_.push_back(static_cast<float>(1 / v.x[at + c]));
      for (std::size_t r = 0; r < below.size() && scale > 0; ++r)
        values_[at + c + 1 + r] = static_cast<std::int16_t>(
            std::lround(std::clamp(below[r] / static_cast<double>(scale), -most, most)));
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
  std::vector<float> below;
  for (const std::uint32_t k : branch.fronts) {
    const SingleFront& f = fronts_[k];
    for (std::size_t r = first_[k]; r < first_[k] + f.columns; ++r)
      x_[r] += sums[r];
    below.assign(f.rows - f.columns, 0.0F);
    kernel.forward(f, x_.data() + first_[k], below.data());
    const std::span rows = rows_below(k);
    for (std::size_t r = 0; r < below.size(); ++r)
      sums[rows[r]] += below[r];
  }
}

void SingleFactor::backward(const Branch& branch, const SingleKernel& kernel) {
  std::vector<float> below;
  for (std::size_t n = branch.fronts.size(); n-- > 0;) {
    const std::uint32_t k = branch.fronts[n];
    const std::span rows = rows_below(k);
    below.resize(rows.size());
    for (std::size_t r = 0; r < below.size(); ++r)
      below[r] = x_[rows[r]];
    kernel.backward(fronts_[k], x_.data() + first_[k], below.data());
  }
}

void SingleFactor::solve(std::span<double> x, const Context& context) {
  const SingleKernel& kernel = single_kernel(context.cpu);
  for (std::size_t k = 0; k < x_.size(); ++k)
    x_[k] = static_cast<float>(x[permutation_[k]]);
  const auto together = [&](const std::vector<std::uint32_t>& level, const auto& work) {
    if (level.size() > 1 && values_.size() >= worth_threads && thread_count(context) > 1)
      parallel_blocks(context, level.size(), 1,
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

} // namespace gewebe
