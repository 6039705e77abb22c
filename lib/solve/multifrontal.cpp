#include "solve/multifrontal.h"

#include "base/error.h"
#include "base/parallel.h"
#include "solve/front_kernel_internal.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

// Based on: Duff, Reid, The Multifrontal Solution of Indefinite Sparse Symmetric Linear Equations,
// 1983; Liu, The multifrontal method for sparse matrix solution: theory and practice, 1992.

namespace gewebe {

namespace {

constexpr std::uint32_t none = FrontTree::none;
constexpr double worth_threads = 1e6;                   // operations
constexpr std::size_t worth_threads_entries = 1U << 18; // to be added or cleared

std::size_t packed(std::size_t rows) {
  return rows * (rows + 1) / 2;
}

double operations(const Front& front) {
  const auto c = static_cast<double>(front.columns), b = static_cast<double>(front.below());
  return c * c * c / 3 + c * c * b + c * b * b;
}

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

/// Rows of a child's update matrix that stand one behind the other in the parent too.
struct Run {
  std::size_t begin = 0, end = 0;
  std::size_t to = 0; // where the first stands
};

/// What a thread works with.
struct Scratch {
  std::vector<std::uint32_t> row;
  std::vector<double> least;
  std::vector<Run> runs;
  std::vector<double> square, strips;
};

/// work(begin, end) over [0, count): on all threads if it is worth them.
template <class Work>
void over(const Context& context, bool worth, std::size_t count, std::size_t grain,
          const Work& work) {
  if (worth && thread_count(context) > 1)
    parallel_blocks(context, count, grain, work);
  else
    work(std::size_t{0}, count);
}

/// The parent's matrix gains rows and columns of a child's update matrix.
void extend_add(const Multifrontal& task, const FrontArrays& into, std::size_t child,
                Scratch& scratch, const Context& context) {
  const Front& from = task.fronts[child];
  const std::size_t below = from.below();
  std::vector<Run>& runs = scratch.runs;
  runs.clear();
  std::size_t size = 0;
  for (const std::uint32_t node : task.tree.boundary_of(child)) {
    const std::size_t axes = task.axes[node], row = scratch.row[node];
    if (!runs.empty() && runs.back().to + size - runs.back().begin == row)
      runs.back().end += axes;
    else
      runs.push_back({size, size + axes, row});
    size += axes;
  }
  const double* const update = from.update.data();
  const std::size_t large = packed(below);
  over(context, large >= worth_threads_entries, below, 64,
       [&](std::size_t first, std::size_t last) {
         auto run = std::partition_point(runs.begin(), runs.end(),
                                         [&](const Run& r) { return r.end <= first; });
         for (std::size_t c = first; c < last; ++c) {
           if (c == run->end)
             ++run;
           const double* const column = update + (c * below - c * (c + 1) / 2); // [r] is row r
           double* const to = into.column(run->to + c - run->begin);
           for (auto rows = run; rows != runs.end(); ++rows) {
             const std::size_t begin = rows == run ? c : rows->begin;
             double* const __restrict there = to + (rows->to + begin - rows->begin);
             const double* const __restrict here = column + begin;
             for (std::size_t k = 0; k < rows->end - begin; ++k)
               there[k] += here[k];
           }
         }
       });
}

/// \throw PivotTooSmall
void eliminate(Front& front, std::size_t f, const FrontArrays& arrays, Scratch& scratch,
               const Context& context) {
  const FrontKernel& kernel =
      context.cpu == CpuLevel::baseline ? front_kernel_baseline : front_kernel_avx2;
  const auto room = [](std::vector<double>& of, std::size_t size) {
    if (of.size() < size)
      of.resize(size);
    return of.data();
  };
  const FrontScratch space{
      room(scratch.square, kernel.square_size(front_block)),
      room(scratch.strips, kernel.strips_size(front.rows, std::min(front.columns, front_block)))};
  for (std::size_t begin = 0; begin < front.columns; begin += front_block) {
    const std::size_t count = std::min(front_block, front.columns - begin);
    const std::size_t done = kernel.eliminate(arrays, begin, count, scratch.least.data(), space);
    if (done < count)
      throw PivotTooSmall{f, begin + done};
    const std::size_t rows = front.rows - begin - count, strips = kernel.strips(rows);
    const auto r = static_cast<double>(rows), c = static_cast<double>(count);
    over(context, r * c * c > worth_threads, strips, 8, [&](std::size_t first, std::size_t last) {
      kernel.solve(arrays, begin, count, space, first, last);
    });
    over(context, r * r * c > worth_threads, strips, 4, [&](std::size_t first, std::size_t last) {
      kernel.update(arrays, begin, count, space, first, last);
    });
  }
}

void compute(const Multifrontal& task, std::size_t f, std::span<const std::uint32_t> children,
             Scratch& scratch, const Context& context) {
  Front& front = task.fronts[f];
  std::uint32_t next = 0;
  const auto place = [&](std::span<const std::uint32_t> nodes) {
    for (const std::uint32_t node : nodes) {
      scratch.row[node] = next;
      next += task.axes[node];
    }
  };
  place(task.tree.eliminated(f));
  place(task.tree.boundary_of(f));
  const FrontArrays arrays{front.rows, front.columns, front.l,
                           front.update.reserve(packed(front.below()), task.keep_updates)};
  const auto clear = [&](double* at, std::size_t size) {
    over(context, size >= worth_threads_entries, size, worth_threads_entries / 4,
         [&](std::size_t first, std::size_t last) { std::fill(at + first, at + last, 0.0); });
  };
  clear(front.l, front.rows * front.columns);
  clear(front.update.data(), packed(front.below()));
  scratch.least.assign(front.columns, 0.0);
  task.assemble({f, scratch.row, front.rows, front.l, scratch.least});
  for (const std::uint32_t child : children) {
    extend_add(task, arrays, child, scratch, context);
    if (!task.keep_updates)
      task.fronts[child].update.release();
  }
  eliminate(front, f, arrays, scratch, context);
  front.weakest = std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < front.columns; ++c) {
    const double root = front.l[c * front.rows + c];
    if (const double pivot = root * root / scratch.least[c]; pivot < front.weakest) {
      front.weakest = pivot;
      front.weakest_column = c;
    }
  }
}

std::vector<std::vector<std::uint32_t>> children_of(const FrontTree& tree) {
  std::vector<std::vector<std::uint32_t>> children(tree.fronts());
  for (std::uint32_t f = 0; f < tree.fronts(); ++f)
    if (tree.parent[f] != none)
      children[tree.parent[f]].push_back(f);
  return children;
}

/// Which fronts are computed where.
struct Plan {
  std::vector<std::pair<std::size_t, std::size_t>> subtrees; ///< ranges, each by one thread
  std::vector<std::size_t> above;                            ///< by all threads
};

/// \param under operations in the subtree of each front
Plan plan(const FrontTree& tree, std::span<const double> under, double all, int threads) {
  Plan p;
  const std::size_t count = tree.fronts();
  const double share = threads == 1 ? 2 * all : all / 16;
  std::vector<std::size_t> smallest(count); // front of each subtree
  for (std::size_t f = 0; f < count; ++f)
    smallest[f] = f;
  for (std::size_t f = 0; f < count; ++f)
    if (const std::uint32_t parent = tree.parent[f]; parent != none)
      smallest[parent] = std::min(smallest[parent], smallest[f]);
  for (std::size_t f = 0; f < count; ++f)
    if (under[f] > share)
      p.above.push_back(f);
    else if (under[f] > 0 && (tree.parent[f] == none || under[tree.parent[f]] > share))
      p.subtrees.emplace_back(smallest[f], f + 1);
  return p;
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
    entries += front.rows * front.columns;
  }
  return entries;
}

double update_bytes(const FrontTree& tree, std::span<const Front> fronts, bool keep_updates,
                    int threads) {
  const std::size_t count = tree.fronts();
  std::vector<double> size(count), under(count);
  double all = 0;
  for (std::size_t f = 0; f < count; ++f) {
    size[f] = 8 * static_cast<double>(packed(fronts[f].below()));
    under[f] += operations(fronts[f]);
    all += operations(fronts[f]);
    if (tree.parent[f] != none)
      under[tree.parent[f]] += under[f];
  }
  double most = 0, now = 0;
  std::vector<double> taken(count); // by children, gone when the front is computed
  const auto one = [&](std::size_t f) {
    now += size[f];
    most = std::max(most, now);
    if (!keep_updates)
      now -= taken[f];
    if (tree.parent[f] != none)
      taken[tree.parent[f]] += size[f];
  };
  const Plan p = plan(tree, under, all, threads);
  double peaks = 0; // beside what the subtrees leave: those of the worst, on each thread
  for (const auto& [first, last] : p.subtrees) {
    const double before = now;
    most = now;
    for (std::size_t f = first; f < last; ++f)
      one(f);
    peaks = std::max(peaks, most - before);
  }
  most = now + (threads == 1 ? 0 : peaks * threads);
  if (p.above.empty())
    most = std::max(most, peaks);
  for (const std::size_t f : p.above)
    one(f);
  return most;
}

FrontalWork factorise(const Multifrontal& task, std::span<const char> wanted,
                      const Context& context) {
  const FrontTree& tree = task.tree;
  const std::size_t count = tree.fronts();
  const std::vector<std::vector<std::uint32_t>> children = children_of(tree);
  const auto is_wanted = [&](std::size_t f) { return wanted.empty() || wanted[f] != 0; };
  std::vector<double> under(count, 0); // operations wanted in the subtree
  FrontalWork work{count, 0, 0, 0};
  for (std::size_t f = 0; f < count; ++f) {
    const double one = operations(task.fronts[f]);
    work.all_operations += one;
    if (is_wanted(f)) {
      ++work.computed;
      work.operations += one;
      under[f] += one;
    }
    if (tree.parent[f] != none)
      under[tree.parent[f]] += under[f];
  }
  Context quiet = context;
  quiet.progress = nullptr;
  Context alone = quiet;
  alone.threads = 1;
  const auto run = [&](std::size_t f, Scratch& scratch, const Context& with) {
    if (with.cancelled && with.cancelled())
      throw Cancelled();
    compute(task, f, children[f], scratch, with);
  };
  const Plan p = plan(tree, under, work.operations, thread_count(context));
  std::vector<std::optional<PivotTooSmall>> failed(p.subtrees.size());
  parallel_blocks(quiet, p.subtrees.size(), 1, [&](std::size_t k, std::size_t) {
    Scratch own;
    own.row.resize(task.axes.size());
    try {
      for (std::size_t f = p.subtrees[k].first; f < p.subtrees[k].second; ++f)
        if (is_wanted(f))
          run(f, own, alone);
    } catch (const PivotTooSmall& pivot) {
      failed[k] = pivot;
    }
  });
  for (const auto& pivot : failed)
    if (pivot)
      throw PivotTooSmall(*pivot);
  Scratch scratch;
  scratch.row.resize(task.axes.size());
  for (const std::size_t f : p.above)
    if (is_wanted(f))
      run(f, scratch, quiet);
  return work;
}

} // namespace gewebe
