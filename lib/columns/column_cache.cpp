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

namespace gewebe::columns {

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
      wide_(std::make_shared<SlotPool<double>>(3 * axes_)),
      narrow_(std::make_shared<SlotPool<float>>(3 * axes_)) {
  now_.columns.write().resize(nodes);
  now_.used.write().resize(nodes);
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
  while (!now_.ahead->empty() && now_.count + count + now_.ahead->size() > capacity_)
    now_.ahead.write().erase(now_.ahead->begin());
  if (now_.count + count <= capacity_)
    return;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> old;
  old.reserve(now_.count);
  for (std::uint32_t node = 0; node < now_.columns->size(); ++node)
    if (resident(node))
      old.emplace_back((*now_.used)[node], node);
  std::sort(old.begin(), old.end());
  for (std::size_t k = 0; now_.count + count > capacity_ && k < old.size(); ++k)
    drop(old[k].second);
}

void ColumnCache::put(std::uint32_t node, Columns columns) {
  if (bounded_)
    columns.bound = columns.wide == nullptr ? bounds_of(columns.narrow.get(), axes_)
                                            : bounds_of(columns.wide.get(), axes_);
  now_.columns.write()[node] = std::make_shared<const Columns>(std::move(columns));
  now_.used.write()[node] = now_.clock;
  ++now_.count;
}

void ColumnCache::drop(std::uint32_t node) {
  now_.columns.write()[node] = nullptr;
  --now_.count;
}

void ColumnCache::need(std::span<const std::uint32_t> nodes) {
  ++now_.clock;
  std::vector<std::uint32_t> missing, unknown;
  for (const std::uint32_t node : nodes)
    if (resident(node))
      now_.used.write()[node] = now_.clock;
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
    Columns columns;
    if (source_->single()) {
      columns.narrow = narrow_->take();
      source_->read_single(k, {columns.narrow.get(), 3 * axes_});
    } else {
      columns.wide = wide_->take();
      source_->read(k, {columns.wide.get(), 3 * axes_});
    }
    ++read_;
    put(node, std::move(columns));
  }
  std::erase_if(unknown, [&](std::uint32_t node) {
    const auto made = now_.ahead->find(node);
    if (made == now_.ahead->end())
      return false;
    put(node, {.wide = made->second});
    now_.ahead.write().erase(node);
    return true;
  });
  solve_for(unknown, [&](std::uint32_t node, std::shared_ptr<double> columns) {
    put(node, {.wide = std::move(columns)});
  });
}

void ColumnCache::solve_for(
    std::span<const std::uint32_t> nodes,
    const std::function<void(std::uint32_t node, std::shared_ptr<double> columns)>& take) {
  std::vector<double> solved;
  for (std::size_t begin = 0; begin < nodes.size(); begin += solved_at_once) {
    const auto some = nodes.subspan(begin, std::min(solved_at_once, nodes.size() - begin));
    solved.resize(3 * axes_ * some.size());
    solve_(some, solved);
    for (std::size_t k = 0; k < some.size(); ++k) {
      std::shared_ptr<double> columns = wide_->take();
      std::copy_n(solved.begin() + static_cast<std::ptrdiff_t>(3 * axes_ * k), 3 * axes_,
                  columns.get());
      take(some[k], std::move(columns));
    }
  }
}

void ColumnCache::prepare(std::span<const std::uint32_t> nodes) {
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t node : nodes)
    if (!stored(node) && !resident(node) && !now_.ahead->contains(node))
      missing.push_back(node);
  const std::size_t all = now_.count + now_.ahead->size() + missing.size();
  if (all > capacity_)
    throw Error("the columns of " + std::to_string(all) +
                " nodes do not fit in memory, expected at most " + std::to_string(capacity_));
  solve_for(missing, [&](std::uint32_t node, std::shared_ptr<double> columns) {
    now_.ahead.write()[node] = std::move(columns);
  });
}

double ColumnCache::entry(std::uint32_t node, int axis, std::size_t row) const {
  const Columns& columns = *(*now_.columns)[node];
  const std::size_t at = static_cast<std::size_t>(axis) * axes_ + row;
  return columns.wide == nullptr ? static_cast<double>(columns.narrow.get()[at])
                                 : columns.wide.get()[at];
}

double ColumnCache::add(std::span<const contact::NodeVector> forces, double allowed,
                        const Context& context, std::span<double> sum) const {
  const std::size_t rows = bounded_ ? bounded_rows : rows_at_once;
  const std::size_t blocks = (axes_ + rows - 1) / rows;
  std::vector<Term> terms;
  terms.reserve(3 * forces.size());
  for (const contact::NodeVector& f : forces) {
    const Columns& columns = *(*now_.columns)[f.node];
    for (int a = 0; a < 3; ++a) {
      if (f.value[a] == 0)
        continue;
      const std::size_t axis = static_cast<std::size_t>(a);
      Term& term = terms.emplace_back();
      term.factor = f.value[a];
      if (columns.wide == nullptr)
        term.narrow = columns.narrow.get() + axis * axes_;
      else
        term.wide = columns.wide.get() + axis * axes_;
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

} // namespace gewebe::columns
