#include "cholesky/multifrontal.h"

#include "base/error.h"
#include "base/parallel.h"
#include "base/team.h"
#include "cholesky/front_kernel_internal.h"
#include "cholesky/front_plan_internal.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <ranges>

// Based on: Duff, Reid, The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations,
// 1983; Liu, The multifrontal method for sparse matrix solution: theory and practice, 1992.

namespace gewebe::cholesky {

namespace {

constexpr std::uint32_t none = FrontTree::none;
constexpr double worth_threads = 1e6;                   // operations
constexpr std::size_t worth_large_tiles = 96;           // rows of a front
constexpr std::size_t worth_threads_entries = 1U << 18; // to be added or cleared

} // namespace

double* FrontMemory::reserve(std::size_t size, bool again) {
  if (data_ == nullptr || size > capacity_) {
    data_.reset();                              // before there is another
    capacity_ = again ? size + size / 4 : size; // what is not used costs nothing
    data_ = std::make_unique_for_overwrite<double[]>(capacity_);
  }
  return data_.get();
}

void FrontMemory::release() noexcept {
  data_.reset();
  capacity_ = 0;
}

namespace {

/// What a thread works with.
struct Scratch {
  std::vector<std::uint32_t> row;
  std::vector<double> min_pivot;
  std::vector<FrontRun> runs;
  std::vector<FrontGain> gains;
  FrontMemory square, strips;
  UpdateStacks stacks;
};

/// work(begin, end) over [0, count): on all threads if it is worth them.
template <class Work>
void over(Team& team, bool worth, std::size_t count, std::size_t grain, const Work& work) {
  if (worth && !team.alone())
    team.blocks(count, grain, work);
  else
    work(std::size_t{0}, count);
}

void find_gains(const Multifrontal& task, std::span<const std::uint32_t> children,
                Scratch& scratch) {
  std::vector<FrontRun>& runs = scratch.runs;
  scratch.gains.clear();
  std::size_t most = 0;
  for (const std::uint32_t child : children)
    most += task.tree.boundary_of(child).size();
  runs.clear();
  runs.reserve(most); // so that they stay where they are
  for (const std::uint32_t child : children) {
    const std::size_t first = runs.size();
    std::size_t size = 0;
    for (const std::uint32_t node : task.tree.boundary_of(child)) {
      const std::size_t axes = task.axes[node], row = scratch.row[node];
      if (runs.size() > first && runs.back().to + size - runs.back().begin == row)
        runs.back().end += axes;
      else
        runs.push_back({size, size + axes, row});
      size += axes;
    }
    scratch.gains.push_back({task.fronts[child].update, size, std::span(runs).subspan(first)});
  }
}

/// The parent's update matrix is cleared, and all of it gains the update matrices of its children:
/// some columns at a time, which stay in the cache meanwhile.
void gather(const Multifrontal& task, const FrontArrays& into,
            std::span<const std::uint32_t> children, const FrontKernel& kernel, Scratch& scratch,
            Team& team) {
  constexpr std::size_t at_once = 16;
  find_gains(task, children, scratch);
  const auto work = [&](std::size_t begin, std::size_t end) {
    for (std::size_t first = begin; first < end; first += at_once) {
      const std::size_t last = std::min(first + at_once, end);
      if (const std::size_t from = std::max(first, into.columns); from < last)
        std::fill(into.column(from) + from, into.column(last - 1) + into.rows, 0.0);
      for (const FrontGain& gain : scratch.gains)
        kernel.add(into, gain, first, last);
    }
  };
  over(team, packed_triangle(into.rows) >= worth_threads_entries, into.rows, 4 * at_once, work);
}

/// The quickest; all give the same bits. Tiles of AVX-512 are too large for small fronts.
const FrontKernel& kernel_for(const Front& front, CpuLevel cpu) {
  if (cpu == CpuLevel::avx512 && front.rows >= worth_large_tiles)
    return front_kernel_avx512;
  return cpu == CpuLevel::baseline ? front_kernel_baseline : front_kernel_avx2;
}

/// \throw PivotTooSmall
void eliminate(const Front& front, std::size_t f, const FrontArrays& arrays,
               const FrontKernel& kernel, Scratch& scratch, Team& team) {
  const FrontScratch space{
      scratch.square.reserve(kernel.square_size(front_block), false),
      scratch.strips.reserve(kernel.strips_size(front.rows, std::min(front.columns, front_block)),
                             true)};
  for (std::size_t begin = 0; begin < front.columns; begin += front_block) {
    const std::size_t count = std::min(front_block, front.columns - begin);
    const std::size_t done =
        kernel.eliminate(arrays, begin, count, scratch.min_pivot.data(), space);
    if (done < count)
      throw PivotTooSmall{f, begin + done};
    const std::size_t rows = front.rows - begin - count, strips = kernel.strips(rows);
    const auto r = static_cast<double>(rows), c = static_cast<double>(count);
    over(team, r * c * c > worth_threads, strips, 8, [&](std::size_t first, std::size_t last) {
      kernel.solve(arrays, begin, count, space, first, last);
    });
    over(team, r * r * c > worth_threads, strips, 4, [&](std::size_t first, std::size_t last) {
      kernel.update(arrays, begin, count, space, first, last);
    });
  }
}

void compute(const Multifrontal& task, const FrontPlan& plan, std::size_t f, Scratch& scratch,
             CpuLevel cpu, Team& team) {
  Front& front = task.fronts[f];
  const FrontKernel& kernel = kernel_for(front, cpu);
  std::uint32_t next = 0;
  const auto place = [&](std::span<const std::uint32_t> nodes) {
    for (const std::uint32_t node : nodes) {
      scratch.row[node] = next;
      next += task.axes[node];
    }
  };
  place(task.tree.eliminated(f));
  place(task.tree.boundary_of(f));
  const bool own = plan.place[f] == FrontPlan::own;
  front.update = own ? front.kept.reserve(packed_triangle(front.below()), task.keep_updates)
                     : scratch.stacks.push(plan.place[f], front.below());
  const FrontArrays arrays{front.rows, front.columns, front.l, front.update};
  const std::size_t size = front.entries();
  over(team, size >= worth_threads_entries, size, worth_threads_entries / 4,
       [&](std::size_t first, std::size_t last) {
         std::fill(front.l + first, front.l + last, 0.0);
       });
  scratch.min_pivot.assign(front.columns, 0.0);
  task.assemble({f, scratch.row, front.rows, front.l, scratch.min_pivot});
  gather(task, arrays, plan.children[f], kernel, scratch, team);
  for (const std::uint32_t child : plan.children[f])
    if (plan.place[child] != FrontPlan::own)
      scratch.stacks.pop(plan.place[child], task.fronts[child].below());
    else if (!task.keep_updates)
      task.fronts[child].kept.release();
  eliminate(front, f, arrays, kernel, scratch, team);
  front.weakest = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < front.columns; ++c) {
    const double root = arrays.column(c)[c];
    if (const double pivot = root * root / scratch.min_pivot[c]; pivot < front.weakest) {
      front.weakest = pivot;
      front.weakest_column = c;
    }
  }
}

} // namespace

std::size_t measure_fronts(const FrontTree& tree, std::span<const std::uint8_t> axes,
                           std::span<Front> fronts) {
  std::size_t entries = 0;
  for (std::size_t f = 0; f < tree.fronts(); ++f) {
    Front& front = fronts[f];
    front.columns = 0;
    for (const std::uint32_t node : tree.eliminated(f))
      front.columns += axes[node];
    front.rows = front.columns;
    for (const std::uint32_t node : tree.boundary_of(f))
      front.rows += axes[node];
    entries += front.entries();
  }
  return entries;
}

FrontBlocks front_blocks(const FrontTree& tree, std::span<const std::uint8_t> axes,
                         std::span<const Front> fronts) {
  FrontBlocks b;
  std::vector<std::int64_t> row(axes.size()), rows; // the first one of each node; of a front
  std::int64_t next = 0;
  for (const std::uint32_t node : tree.sequence) {
    row[node] = next;
    next += axes[node];
  }
  std::size_t all = 0;
  for (std::size_t f = 0; f < tree.fronts(); ++f)
    for (std::size_t c = 0; c < fronts[f].columns; c += front_block)
      all += fronts[f].rows - c;
  b.s.reserve(all);
  for (std::size_t f = 0; f < tree.fronts(); ++f) {
    rows.clear();
    const auto add = [&](std::span<const std::uint32_t> nodes) {
      for (const std::uint32_t node : nodes)
        for (std::uint8_t a = 0; a < axes[node]; ++a)
          rows.push_back(row[node] + a);
    };
    add(tree.eliminated(f));
    add(tree.boundary_of(f));
    const std::size_t columns = fronts[f].columns;
    for (std::size_t c = 0; c < columns; c += front_block) {
      const std::size_t count = std::min(front_block, columns - c);
      b.s.insert(b.s.end(), rows.begin() + static_cast<std::ptrdiff_t>(c), rows.end());
      b.super.push_back(b.super.back() + static_cast<std::int64_t>(count));
      b.pi.push_back(static_cast<std::int64_t>(b.s.size()));
      b.longest = std::max(b.longest, rows.size() - c - count);
    }
    b.first.push_back(static_cast<std::uint32_t>(b.super.size() - 1));
  }
  return b;
}

double update_bytes(const FrontTree& tree, std::span<const Front> fronts, bool keep_updates,
                    int threads) {
  const std::size_t count = tree.fronts();
  std::vector<double> under(count);
  double all = 0;
  for (std::size_t f = 0; f < count; ++f) {
    const double one = front_operations(fronts[f]);
    under[f] += one;
    all += one;
    if (tree.parent[f] != none)
      under[tree.parent[f]] += under[f];
  }
  const FrontPlan plan = front_plan(tree, under, all, threads, keep_updates);
  std::size_t kept = 0, subtree = 0; // the most that one of them needs
  for (std::size_t f = 0; f < count; ++f)
    if (plan.place[f] == FrontPlan::own)
      kept += packed_triangle(fronts[f].below());
  for (const auto& [first, last] : plan.subtrees) {
    UpdateStacks::Size size;
    for (std::size_t f = first; f < last; ++f)
      size.compute(plan, fronts, f);
    subtree = std::max(subtree, size.numbers());
  }
  UpdateStacks::Size above;
  for (const std::size_t f : plan.above)
    above.compute(plan, fronts, f);
  const auto at_once = static_cast<std::size_t>(std::max(threads, 1));
  return 8 * static_cast<double>(kept + std::max(subtree * at_once, above.numbers()));
}

FrontalWork factorise(const Multifrontal& task, std::span<const char> selected,
                      const Context& context) {
  const FrontTree& tree = task.tree;
  const std::size_t count = tree.fronts();
  const auto is_selected = [&](std::size_t f) { return selected.empty() || selected[f] != 0; };
  std::vector<double> under(count, 0); // operations of the subtree's selected fronts
  FrontalWork work{count, 0, 0, 0};
  for (std::size_t f = 0; f < count; ++f) {
    const double one = front_operations(task.fronts[f]);
    work.all_operations += one;
    if (is_selected(f)) {
      ++work.computed;
      work.operations += one;
      under[f] += one;
    }
    if (tree.parent[f] != none)
      under[tree.parent[f]] += under[f];
  }
  const FrontPlan plan =
      front_plan(tree, under, work.operations, thread_count(context), task.keep_updates);
  // Computes the selected fronts of `some`, one after the other.
  const auto run = [&](const auto& some, gewebe::Team& team) {
    gewebe::cholesky::UpdateStacks::Size size;
    for (const std::size_t f : some)
      size.compute(plan, task.fronts, f);
    gewebe::cholesky::Scratch scratch;
    scratch.row.resize(task.axes.size());
    scratch.stacks.prepare(size);
    for (const std::size_t f : some)
      if (is_selected(f)) {
        if (context.cancelled && context.cancelled())
          throw gewebe::Cancelled();
        gewebe::cholesky::compute(task, plan, f, scratch, context.cpu, team);
      }
  };
  std::vector<std::optional<PivotTooSmall>> failed(plan.subtrees.size());
  lead_team(context, [&](Team& team) {
    team.blocks(plan.subtrees.size(), 1, [&](std::size_t k, std::size_t) {
      Team alone;
      try {
        run(std::views::iota(plan.subtrees[k].first, plan.subtrees[k].second), alone);
      } catch (const PivotTooSmall& pivot) {
        failed[k] = pivot;
      }
    });
    std::optional<PivotTooSmall> first;
    for (const auto& pivot : failed)
      if (pivot && (!first || pivot->front < first->front))
        first = pivot;
    if (first)
      throw PivotTooSmall(*first);
    run(plan.above, team);
  });
  return work;
}

} // namespace gewebe::cholesky
