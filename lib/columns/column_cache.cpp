#include "columns/column_cache.h"

#include "base/error.h"
#include "base/parallel.h"
#include "columns/column_sum.h"
#include "columns/costs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace gewebe {

namespace {

// Rows whose sums stay in the first cache, and fewer where blocks of them may be left out.
constexpr std::size_t rows_at_once = 3072, bounded_rows = 768;
constexpr std::size_t solved_at_once = 8;

float rounded_up(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) < value
             ? std::nextafter(nearest, std::numeric_limits<float>::infinity())
             : nearest;
}

template <class Entry>
std::vector<float> bounds_of(const Entry* columns, std::size_t axes) {
  std::vector<float> bounds;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t begin = 0; begin < axes; begin += bounded_rows) {
      Entry max = 0;
      const std::size_t end = std::min(axes, begin + bounded_rows);
      for (std::size_t r = begin; r < end; ++r)
        max = std::max(max, std::abs(columns[axis * axes + r]));
      bounds.push_back(rounded_up(static_cast<double>(max)));
    }
  return bounds;
}

} // namespace

/// One column with its factor.
struct ColumnCache::Term {
  const double* wide = nullptr;
  const float* narrow = nullptr;
  const float* bound = nullptr;
  double factor = 0;
};

ColumnCache::ColumnCache(std::size_t nodes, const ColumnSource* source, ColumnSolve solve,
                         double bytes, bool bounded)
    : axes_(3 * nodes), source_(source), solve_(std::move(solve)), bounded_(bounded),
      wide_(3 * axes_), narrow_(3 * axes_) {
  const bool single = source_ != nullptr && source_->single();
  const double each = (single ? 12.0 : 24.0) * static_cast<double>(axes_);
  capacity_ = std::max<std::size_t>(2, static_cast<std::size_t>(bytes / each));
}

bool ColumnCache::stored(std::uint32_t node) const {
  return source_ != nullptr &&
         std::binary_search(source_->nodes().begin(), source_->nodes().end(), node);
}

/// Makes room for new columns. \param count  of them; some may have been prepared
void ColumnCache::make_room(std::size_t count) {
  while (!ahead_.empty() && kept_.size() + count + ahead_.size() > capacity_) {
    wide_.give_back(ahead_.begin()->second);
    ahead_.erase(ahead_.begin());
  }
  if (kept_.size() + count <= capacity_)
    return;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> old;
  old.reserve(kept_.size());
  for (const auto& [node, columns] : kept_)
    old.emplace_back(columns.used, node);
  std::sort(old.begin(), old.end());
  for (std::size_t k = 0; kept_.size() + count > capacity_ && k < old.size(); ++k)
    drop(old[k].second);
}

ColumnCache::Columns& ColumnCache::fresh(std::uint32_t node, bool single) {
  Columns& columns = kept_[node];
  if (single)
    columns.narrow = narrow_.take();
  else
    columns.wide = wide_.take();
  columns.used = clock_;
  return columns;
}

void ColumnCache::drop(std::uint32_t node) {
  const auto found = kept_.find(node);
  if (found->second.wide != nullptr)
    wide_.give_back(found->second.wide);
  if (found->second.narrow != nullptr)
    narrow_.give_back(found->second.narrow);
  kept_.erase(found);
}

void ColumnCache::need(std::span<const std::uint32_t> nodes) {
  ++clock_;
  std::vector<std::uint32_t> missing, unknown;
  for (const std::uint32_t node : nodes)
    if (const auto found = kept_.find(node); found != kept_.end())
      found->second.used = clock_;
    else
      missing.push_back(node);
  make_room(missing.size());
  const auto there = static_cast<std::size_t>(
      std::count_if(missing.begin(), missing.end(), [&](std::uint32_t i) { return stored(i); }));
  const bool read = source_ != nullptr && source_->pays(there);
  for (const std::uint32_t node : missing) {
    if (!read || !stored(node)) {
      unknown.push_back(node);
      continue;
    }
    const std::vector<std::uint32_t>& all = source_->nodes();
    const auto k =
        static_cast<std::size_t>(std::lower_bound(all.begin(), all.end(), node) - all.begin());
    Columns& columns = fresh(node, source_->single());
    try {
      if (source_->single())
        source_->read_single(k, {columns.narrow, 3 * axes_});
      else
        source_->read(k, {columns.wide, 3 * axes_});
    } catch (...) {
      drop(node);
      throw;
    }
    ++read_;
    bound(columns);
  }
  std::erase_if(unknown, [&](std::uint32_t node) {
    const auto made = ahead_.find(node);
    if (made == ahead_.end())
      return false;
    Columns& columns = kept_[node];
    columns.wide = made->second;
    columns.used = clock_;
    ahead_.erase(made);
    bound(columns);
    return true;
  });
  solve_for(unknown, [&](std::uint32_t node) { return fresh(node, false).wide; });
  for (const std::uint32_t node : unknown)
    bound(kept_.at(node));
}

void ColumnCache::solve_for(std::span<const std::uint32_t> nodes,
                            const std::function<double*(std::uint32_t node)>& place) {
  std::vector<double> solved;
  for (std::size_t begin = 0; begin < nodes.size(); begin += solved_at_once) {
    const auto some = nodes.subspan(begin, std::min(solved_at_once, nodes.size() - begin));
    solved.resize(3 * axes_ * some.size());
    solve_(some, solved);
    for (std::size_t k = 0; k < some.size(); ++k)
      std::copy_n(solved.begin() + static_cast<std::ptrdiff_t>(3 * axes_ * k), 3 * axes_,
                  place(some[k]));
  }
}

void ColumnCache::prepare(std::span<const std::uint32_t> nodes) {
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t node : nodes)
    if (!stored(node) && !resident(node) && !ahead_.contains(node))
      missing.push_back(node);
  if (kept_.size() + ahead_.size() + missing.size() > capacity_)
    throw Error("the columns of " + std::to_string(kept_.size() + ahead_.size() + missing.size()) +
                " nodes do not fit in memory, expected at most " + std::to_string(capacity_));
  solve_for(missing, [&](std::uint32_t node) { return ahead_[node] = wide_.take(); });
}

void ColumnCache::bound(Columns& columns) const {
  if (bounded_)
    columns.bound =
        columns.wide == nullptr ? bounds_of(columns.narrow, axes_) : bounds_of(columns.wide, axes_);
}

double ColumnCache::entry(std::uint32_t node, int axis, std::size_t row) const {
  const Columns& columns = kept_.at(node);
  const std::size_t at = static_cast<std::size_t>(axis) * axes_ + row;
  return columns.wide == nullptr ? static_cast<double>(columns.narrow[at]) : columns.wide[at];
}

double ColumnCache::add(std::span<const NodeVector> forces, double allowed, const Context& context,
                        std::span<double> sum) const {
  const std::size_t rows = bounded_ ? bounded_rows : rows_at_once;
  const std::size_t blocks = (axes_ + rows - 1) / rows;
  std::vector<Term> terms;
  terms.reserve(3 * forces.size());
  for (const NodeVector& f : forces) {
    const Columns& columns = kept_.at(f.node);
    for (int a = 0; a < 3; ++a) {
      if (f.value[a] == 0)
        continue;
      const std::size_t axis = static_cast<std::size_t>(a);
      Term& term = terms.emplace_back();
      term.factor = f.value[a];
      if (columns.wide == nullptr)
        term.narrow = columns.narrow + axis * axes_;
      else
        term.wide = columns.wide + axis * axes_;
      if (bounded_)
        term.bound = columns.bound.data() + axis * blocks;
    }
  }
  // Kinds apart: a fixed order, and long runs of one.
  const auto narrow_first = std::stable_partition(terms.begin(), terms.end(),
                                                  [](const Term& t) { return t.wide != nullptr; });
  const auto wide_count = static_cast<std::size_t>(narrow_first - terms.begin());

  std::vector<double> left_out(blocks, 0);
  std::vector<std::size_t> used(blocks, 0);
  const auto sum_block = [&](std::size_t block, std::vector<const double*>& wide,
                             std::vector<const float*>& narrow, std::vector<double>& factor,
                             std::vector<double>& size) {
    double limit = -1; // contributions up to it are skipped
    if (allowed > 0) {
      size.clear();
      for (const Term& t : terms)
        size.push_back(std::abs(t.factor) * static_cast<double>(t.bound[block]));
      std::sort(size.begin(), size.end());
      double skipped = 0;
      for (std::size_t k = 0; k < size.size(); ++k) {
        // Equal bounds are skipped together or not at all, so that the limit alone decides.
        const double next = k + 1 < size.size() ? size[k + 1] : HUGE_VAL;
        skipped += size[k];
        if (!(skipped * (1 + 1e-12) <= allowed))
          break;
        if (size[k] < next) {
          limit = size[k];
          left_out[block] = skipped;
        }
      }
    }
    wide.clear();
    narrow.clear();
    factor.clear();
    for (const Term& t : terms) {
      if (limit >= 0 && std::abs(t.factor) * static_cast<double>(t.bound[block]) <= limit)
        continue;
      factor.push_back(t.factor);
      if (t.wide != nullptr)
        wide.push_back(t.wide);
      else
        narrow.push_back(t.narrow);
    }
    used[block] = factor.size();
    const std::size_t begin = block * rows, end = std::min(axes_, begin + rows);
    if (!wide.empty())
      column_sum<double>(context.cpu)(wide.data(), factor.data(), wide.size(), sum.data(), begin,
                                      end);
    if (!narrow.empty())
      column_sum<float>(context.cpu)(narrow.data(), factor.data() + wide.size(), narrow.size(),
                                     sum.data(), begin, end);
  };
  Context some = context;
  if (terms.size() * axes_ < costs::worth_threads)
    some.threads = 1;
  const std::size_t grain = std::max<std::size_t>(1, blocks / 16);
  parallel_blocks(some, blocks, grain, [&](std::size_t begin, std::size_t end) {
    std::vector<const double*> wide;
    std::vector<const float*> narrow;
    std::vector<double> factor, size;
    wide.reserve(wide_count);
    narrow.reserve(terms.size() - wide_count);
    factor.reserve(terms.size());
    for (std::size_t block = begin; block < end; ++block)
      sum_block(block, wide, narrow, factor, size);
  });
  for (const std::size_t k : used) {
    taken_ += k;
    skipped_ += terms.size() - k;
  }
  double max = 0;
  for (const double value : left_out)
    max = std::max(max, value);
  return max;
}

} // namespace gewebe
