#include "solve/single_factor.h"

#include "base/parallel.h"
#include "solve/single_factor_internal.h"

#include <algorithm>

namespace gewebe {

namespace {

constexpr std::uint32_t none = UINT32_MAX;
/// Of all entries, that a subtree has at most: some subtrees for each of a few threads, and not too
/// much above them, which one thread does.
constexpr double part = 0.25;
constexpr std::size_t worth_threads = 1U << 18; // entries

} // namespace

SingleFactor::SingleFactor(const Factor& factor) {
  const FactorView v = factor.view();
  const std::size_t count = v.super.size() - 1;
  values_.resize(v.x.size());
  std::ranges::transform(v.x, values_.begin(), [](double x) { return static_cast<float>(x); });
  for (const std::int64_t p : v.permutation)
    permutation_.push_back(static_cast<std::uint32_t>(p));
  x_.resize(permutation_.size());

  std::vector<std::uint32_t> front_of(order()), parent(count, none);
  std::vector<double> size(count);
  for (std::size_t k = 0; k < count; ++k) {
    const auto first = static_cast<std::size_t>(v.super[k]),
               columns = static_cast<std::size_t>(v.super[k + 1]) - first,
               rows = static_cast<std::size_t>(v.pi[k + 1] - v.pi[k]);
    fronts_.push_back({values_.data() + v.px[k], rows, columns});
    first_.push_back(first);
    start_.push_back(row_.size());
    for (std::size_t r = columns; r < rows; ++r)
      row_.push_back(static_cast<std::uint32_t>(v.s[static_cast<std::size_t>(v.pi[k]) + r]));
    std::fill_n(front_of.begin() + static_cast<std::ptrdiff_t>(first), columns,
                static_cast<std::uint32_t>(k));
  }
  start_.push_back(row_.size());
  double all = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double own = static_cast<double>(fronts_[k].rows * fronts_[k].columns);
    size[k] += own;
    all += own;
    if (start_[k] < start_[k + 1]) {
      parent[k] = front_of[row_[start_[k]]];
      size[parent[k]] += size[k];
    }
  }
  std::vector<std::uint32_t> subtree(count, none);
  for (std::size_t k = count; k-- > 0;) {
    if (size[k] > part * all)
      continue;
    if (parent[k] != none && subtree[parent[k]] != none) {
      subtree[k] = subtree[parent[k]];
    } else {
      subtree[k] = static_cast<std::uint32_t>(subtrees_.size());
      subtrees_.emplace_back();
    }
  }
  for (std::uint32_t k = 0; k < count; ++k)
    (subtree[k] == none ? above_ : subtrees_[subtree[k]].fronts).push_back(k);
  for (Subtree& tree : subtrees_) {
    tree.first = first_[tree.fronts.front()];
    tree.sums.resize(order() - tree.first);
  }
}

void SingleFactor::gather(std::uint32_t front, const Subtree& tree) {
  const std::size_t begin = first_[front], end = begin + fronts_[front].columns;
  for (std::size_t r = std::max(begin, tree.first); r < end; ++r)
    x_[r] += tree.sums[r - tree.first];
}

void SingleFactor::forward(std::uint32_t front, const SingleKernel& kernel, float* sums,
                           std::vector<float>& below) {
  const SingleFront& f = fronts_[front];
  below.assign(f.rows - f.columns, 0.0F);
  kernel.forward(f, x_.data() + first_[front], below.data());
  const std::uint32_t* const row = row_.data() + start_[front];
  for (std::size_t r = 0; r < below.size(); ++r)
    sums[row[r]] += below[r];
}

void SingleFactor::backward(std::uint32_t front, const SingleKernel& kernel,
                            std::vector<float>& below) {
  const SingleFront& f = fronts_[front];
  const std::uint32_t* const row = row_.data() + start_[front];
  below.resize(f.rows - f.columns);
  for (std::size_t r = 0; r < below.size(); ++r)
    below[r] = x_[row[r]];
  kernel.backward(f, x_.data() + first_[front], below.data());
}

void SingleFactor::solve(std::span<double> x, const Context& context) {
  const SingleKernel& kernel = single_kernel(context.cpu);
  for (std::size_t k = 0; k < x_.size(); ++k)
    x_[k] = static_cast<float>(x[permutation_[k]]);
  const auto for_subtrees = [&](const auto& work) {
    if (values_.size() >= worth_threads && thread_count(context) > 1)
      parallel_blocks(context, subtrees_.size(), 1, [&](std::size_t n, std::size_t) { work(n); });
    else
      for (std::size_t n = 0; n < subtrees_.size(); ++n)
        work(n);
  };
  for_subtrees([&](std::size_t n) {
    Subtree& tree = subtrees_[n];
    std::ranges::fill(tree.sums, 0.0F);
    std::vector<float> below;
    for (const std::uint32_t k : tree.fronts) {
      gather(k, tree);
      forward(k, kernel, tree.sums.data() - tree.first, below);
    }
  });
  std::vector<float> below;
  for (const std::uint32_t k : above_) {
    for (const Subtree& tree : subtrees_)
      gather(k, tree);
    forward(k, kernel, x_.data(), below);
  }
  for (std::size_t n = above_.size(); n-- > 0;)
    backward(above_[n], kernel, below);
  for_subtrees([&](std::size_t n) {
    std::vector<float> rows;
    for (std::size_t k = subtrees_[n].fronts.size(); k-- > 0;)
      backward(subtrees_[n].fronts[k], kernel, rows);
  });
  for (std::size_t k = 0; k < x_.size(); ++k)
    x[permutation_[k]] = static_cast<double>(x_[k]);
}

} // namespace gewebe
