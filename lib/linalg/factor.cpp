#include "linalg/factor.h"

#include "base/error.h"
#include "base/parallel.h"
#include "cholesky/multifrontal.h"
#include "cholesky/ordering.h"
#include "linalg/supernodal_solve_internal.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace gewebe::linalg {

namespace {

// ---- arrays from a file

void require(bool good, const char* what) {
  if (!good)
    throw Error(std::string("the factor is damaged: ") + what);
}

/// The rows of supernode k: its own columns first, then rows below them, ascending.
void check_supernode(const FactorData& d, std::size_t k, std::int64_t& longest) {
  const std::int64_t first = d.super[k], columns = d.super[k + 1] - first;
  const std::int64_t begin = d.pi[k], rows = d.pi[k + 1] - begin;
  require(rows >= columns, "a supernode has fewer rows than columns");
  longest = std::max(longest, rows - columns);
  std::int64_t block = 0;
  require(!__builtin_mul_overflow(rows, columns, &block) && d.px[k + 1] - d.px[k] == block,
          "the values of a supernode are not rows times columns");
  for (std::int64_t r = 0; r < rows; ++r) {
    const std::int64_t row = d.s[static_cast<std::size_t>(begin + r)];
    if (r < columns)
      require(row == first + r, "a supernode's first rows are not its columns");
    else
      require(row > d.s[static_cast<std::size_t>(begin + r - 1)] && row < d.order,
              "the rows of a supernode don't ascend");
  }
  const double* const x = d.x.data() + d.px[k];
  for (std::int64_t c = 0; c < columns; ++c)
    require(x[c * rows + c] > 0, "a pivot is not positive");
}

void check_bounds(const std::vector<std::int64_t>& starts, std::size_t entries, bool strictly,
                  const char* what) {
  require(starts.front() == 0 && starts.back() >= 0 &&
              static_cast<std::uint64_t>(starts.back()) == entries,
          what);
  for (std::size_t k = 1; k < starts.size(); ++k)
    require(strictly ? starts[k] > starts[k - 1] : starts[k] >= starts[k - 1], what);
}

void check_data(const FactorData& d) {
  require(d.order > 0 && d.order <= std::int64_t{1} << 40, "its order is out of range");
  const auto n = static_cast<std::size_t>(d.order);
  require(d.permutation.size() == n && d.column_count.size() == n, "its order contradicts itself");
  std::vector<bool> seen(n);
  for (const std::int64_t row : d.permutation) {
    require(row >= 0 && row < d.order && !seen[static_cast<std::size_t>(row)],
            "its permutation is none");
    seen[static_cast<std::size_t>(row)] = true;
  }
  for (const std::int64_t count : d.column_count)
    require(count >= 1 && count <= d.order, "a column's count is out of range");
  require(d.super.size() >= 2 && d.pi.size() == d.super.size() && d.px.size() == d.super.size(),
          "the number of its supernodes contradicts itself");
  check_bounds(d.super, n, true, "its supernodes don't divide its columns");
  check_bounds(d.pi, d.s.size(), true, "its supernodes don't divide its rows");
  check_bounds(d.px, d.x.size(), true, "its supernodes don't divide its values");
  std::int64_t longest = 1; // as CHOLMOD counts
  for (std::size_t k = 0; k + 1 < d.super.size(); ++k)
    check_supernode(d, k, longest);
  require(d.max_row_size == longest && d.max_column_size >= 0, "its largest sizes are wrong");
  require(std::all_of(d.x.begin(), d.x.end(), [](double value) { return std::isfinite(value); }),
          "a value is not finite");
}

} // namespace

NotPositiveDefinite::NotPositiveDefinite(std::size_t row)
    : Error("the stiffness matrix is not positive definite (row " + std::to_string(row) + ")"),
      row_(row) {}

namespace {

/// The nodes of a matrix: which rows belong together, and what they are coupled to.
struct Nodes {
  std::vector<std::uint32_t> of_row;
  std::vector<std::uint32_t> first_row; ///< of each
  std::vector<std::uint8_t> axes;       ///< rows of each
  std::vector<std::size_t> start;       ///< n + 1, into
  std::vector<std::uint32_t> neighbour;

  cholesky::BlockGraph graph() const noexcept { return {start, neighbour, axes}; }
};

template <class Visit> // visit(node, another behind it), each pair once
void visit_pairs(const StiffnessMatrix& matrix, const Nodes& nodes, const Visit& visit) {
  std::vector<std::uint32_t> seen(nodes.axes.size(), UINT32_MAX);
  for (std::size_t c = 0; c < matrix.order(); ++c) {
    const std::uint32_t node = nodes.of_row[c];
    for (auto at = static_cast<std::size_t>(matrix.column_start[c]);
         at < static_cast<std::size_t>(matrix.column_start[c + 1]); ++at)
      if (const std::uint32_t other = nodes.of_row[static_cast<std::size_t>(matrix.row[at])];
          other != node && std::exchange(seen[other], node) != node)
        visit(node, other);
  }
}

Nodes nodes_of(const StiffnessMatrix& matrix) {
  Nodes nodes;
  nodes.of_row.resize(matrix.order());
  for (std::size_t r = 0; r < matrix.order(); ++r) {
    if (r == 0 || matrix.axis_of_row[r] / 3 != matrix.axis_of_row[r - 1] / 3) {
      nodes.first_row.push_back(static_cast<std::uint32_t>(r));
      nodes.axes.push_back(0);
    }
    ++nodes.axes.back();
    nodes.of_row[r] = static_cast<std::uint32_t>(nodes.axes.size() - 1);
  }
  nodes.start.assign(nodes.axes.size() + 1, 0);
  visit_pairs(matrix, nodes, [&](std::uint32_t a, std::uint32_t b) {
    ++nodes.start[a + std::size_t{1}];
    ++nodes.start[b + std::size_t{1}];
  });
  for (std::size_t i = 0; i < nodes.axes.size(); ++i)
    nodes.start[i + 1] += nodes.start[i];
  nodes.neighbour.resize(nodes.start.back());
  std::vector<std::size_t> next(nodes.start.begin(), nodes.start.end() - 1);
  visit_pairs(matrix, nodes, [&](std::uint32_t a, std::uint32_t b) {
    nodes.neighbour[next[a]++] = b;
    nodes.neighbour[next[b]++] = a;
  });
  return nodes;
}

/// Entries of a matrix by the node that is eliminated first of the two that they couple.
struct Entries {
  struct Place {
    std::uint32_t entry, column;
  };
  std::vector<std::size_t> start; ///< nodes + 1
  std::vector<Place> places;
};

Entries entries_of(const StiffnessMatrix& matrix, const Nodes& nodes,
                   const cholesky::FrontTree& tree) {
  Entries entries;
  entries.start.assign(nodes.axes.size() + 1, 0);
  const auto visit = [&](const auto& each) {
    for (std::size_t c = 0; c < matrix.order(); ++c)
      for (auto at = static_cast<std::size_t>(matrix.column_start[c]);
           at < static_cast<std::size_t>(matrix.column_start[c + 1]); ++at) {
        const std::uint32_t a = nodes.of_row[c];
        const std::uint32_t b = nodes.of_row[static_cast<std::size_t>(matrix.row[at])];
        each(tree.position[a] < tree.position[b] ? a : b, static_cast<std::uint32_t>(at),
             static_cast<std::uint32_t>(c));
      }
  };
  visit([&](std::uint32_t node, std::uint32_t, std::uint32_t) {
    ++entries.start[node + std::size_t{1}];
  });
  for (std::size_t i = 0; i < nodes.axes.size(); ++i)
    entries.start[i + 1] += entries.start[i];
  entries.places.resize(matrix.row.size());
  std::vector<std::size_t> next(entries.start.begin(), entries.start.end() - 1);
  visit([&](std::uint32_t node, std::uint32_t at, std::uint32_t c) {
    entries.places[next[node]++] = {at, c};
  });
  return entries;
}

} // namespace

/// Arrays from a file, or made by fronts.
struct Factor::State {
  FactorData data; // `x` only of one from a file
  std::unique_ptr<double[]> made;
  std::span<const double> x;
  CpuLevel cpu;

  // What depends on the pattern alone.
  Nodes nodes;
  cholesky::FrontTree tree;
  Entries entries;
  std::vector<cholesky::Front> fronts;
  std::vector<std::uint32_t> block; ///< fronts + 1: the first supernode of each

  explicit State(CpuLevel level) : cpu(level) {}

  /// Supernodes, each a block of what a front eliminates.
  void lay_out() {
    FactorData& d = data;
    for (const std::uint32_t node : tree.sequence)
      for (std::uint32_t a = 0; a < nodes.axes[node]; ++a)
        d.permutation.push_back(nodes.first_row[node] + a);
    d.order = static_cast<std::int64_t>(d.permutation.size());
    cholesky::FrontBlocks blocks = cholesky::front_blocks(tree, nodes.axes, fronts);
    d.px = {0};
    for (std::size_t k = 0; k + 1 < blocks.super.size(); ++k) {
      const std::int64_t columns = blocks.super[k + 1] - blocks.super[k];
      const std::int64_t rows = blocks.pi[k + 1] - blocks.pi[k];
      d.px.push_back(d.px.back() + rows * columns);
      for (std::int64_t c = 0; c < columns; ++c)
        d.column_count.push_back(rows - c);
    }
    d.super = std::move(blocks.super);
    d.pi = std::move(blocks.pi);
    d.s = std::move(blocks.s);
    block = std::move(blocks.first);
    d.max_row_size = static_cast<std::int64_t>(blocks.longest);
    d.max_column_size = d.max_row_size * d.max_row_size;
  }

  std::size_t first_column(std::size_t front) const {
    return static_cast<std::size_t>(data.super[block[front]]);
  }

  void analyse(const StiffnessMatrix& matrix) {
    if (matrix.row.size() > UINT32_MAX)
      throw Error("the stiffness matrix is too large to be factorised");
    nodes = nodes_of(matrix);
    tree = cholesky::front_tree(nodes.graph(), cholesky::elimination_order(nodes.graph()));
    entries = entries_of(matrix, nodes, tree);
    fronts.resize(tree.fronts());
    (void)cholesky::measure_fronts(tree, nodes.axes, fronts);
    lay_out();
  }

  void assemble(const StiffnessMatrix& matrix, const cholesky::FrontAssembly& to) const {
    const auto row = [&](std::size_t r) {
      const std::uint32_t node = nodes.of_row[r];
      return to.row[node] + (static_cast<std::uint32_t>(r) - nodes.first_row[node]);
    };
    for (const std::uint32_t node : tree.eliminated(to.front))
      for (std::size_t k = entries.start[node]; k < entries.start[node + std::size_t{1}]; ++k) {
        const auto [at, c] = entries.places[k];
        const std::uint32_t i = row(static_cast<std::size_t>(matrix.row[at])), j = row(c);
        to.at(std::max(i, j), std::min(i, j)) += matrix.value[at];
      }
  }

  void factorise(const StiffnessMatrix& matrix, const Context& context) {
    const auto size = static_cast<std::size_t>(data.px.back());
    require_memory(context,
                   8 * static_cast<double>(size + data.s.size() + matrix.row.size()) +
                       cholesky::update_bytes(tree, fronts, false, thread_count(context)),
                   "the factor of the stiffness matrix");
    if (made == nullptr)
      made = std::make_unique_for_overwrite<double[]>(size);
    x = {made.get(), size};
    for (std::size_t f = 0; f < fronts.size(); ++f)
      fronts[f].l = made.get() + data.px[block[f]];
    try {
      (void)gewebe::cholesky::factorise(
          {.tree = tree,
           .axes = nodes.axes,
           .fronts = fronts,
           .assemble = [&](const cholesky::FrontAssembly& to) { assemble(matrix, to); }},
          {}, context);
    } catch (const cholesky::PivotTooSmall& pivot) {
      throw NotPositiveDefinite(
          static_cast<std::size_t>(data.permutation[first_column(pivot.front) + pivot.column]));
    }
  }
};

Factor::~Factor() = default;
Factor::Factor(Factor&&) noexcept = default;
Factor& Factor::operator=(Factor&&) noexcept = default;

Factor::Factor(const StiffnessMatrix& matrix, const Context& context)
    : state_(std::make_unique<State>(context.cpu)) {
  if (context.cancelled && context.cancelled())
    throw Cancelled();
  state_->analyse(matrix);
  state_->factorise(matrix, context);
}

void Factor::refactor(const StiffnessMatrix& matrix, const Context& context) {
  state_->factorise(matrix, context);
}

Factor::Factor(FactorData data, CpuLevel cpu) : state_(std::make_unique<State>(cpu)) {
  check_data(data);
  state_->data = std::move(data);
  state_->x = state_->data.x;
}

std::size_t Factor::order() const noexcept {
  return static_cast<std::size_t>(state_->data.order);
}

std::size_t Factor::entries() const noexcept {
  return state_->x.size();
}

FactorView Factor::view() const noexcept {
  const FactorData& d = state_->data;
  return {d.order,
          d.max_column_size,
          d.max_row_size,
          d.permutation,
          d.column_count,
          d.super,
          d.pi,
          d.px,
          d.s,
          state_->x};
}

FactorData Factor::data() const {
  const FactorView v = view();
  const auto copy = [](auto span) { return std::vector(span.begin(), span.end()); };
  return {
      v.order,       v.max_column_size, v.max_row_size, copy(v.permutation), copy(v.column_count),
      copy(v.super), copy(v.pi),        copy(v.px),     copy(v.s),           copy(v.x)};
}

namespace {

SupernodalArrays arrays_of(const FactorView& v) {
  return {v.super.size() - 1, v.super.data(), v.pi.data(), v.px.data(), v.s.data(), v.x.data()};
}

std::size_t supernode_of(const FactorView& v, std::int64_t column) {
  return static_cast<std::size_t>(std::upper_bound(v.super.begin(), v.super.end(), column) -
                                  v.super.begin() - 1);
}

/// The supernodes that units at these places reach in the first half of a solve, ascending.
std::vector<std::uint32_t> reached_from(const FactorView& v, std::span<const std::int64_t> places) {
  std::vector<bool> reached(v.super.size() - 1);
  for (const std::int64_t place : places)
    reached[supernode_of(v, place)] = true;
  std::vector<std::uint32_t> all;
  for (std::size_t k = 0; k < reached.size(); ++k) {
    if (!reached[k])
      continue;
    all.push_back(static_cast<std::uint32_t>(k));
    const std::span<const std::int64_t> rows = v.s.subspan(
        static_cast<std::size_t>(v.pi[k]), static_cast<std::size_t>(v.pi[k + 1] - v.pi[k]));
    std::int64_t known = v.super[k + 1]; // rows ascend: those before it are of a supernode that is
    for (const std::int64_t row : rows)
      if (row >= known) {
        const std::size_t above = supernode_of(v, row);
        reached[above] = true;
        known = v.super[above + 1];
      }
  }
  return all;
}

} // namespace

void Factor::solve(std::span<const double> f, std::span<double> u, std::size_t columns) const {
  const FactorView l = view();
  const std::span<const std::int64_t> permutation = l.permutation;
  const std::size_t n = order();
  std::vector<double> x, work;
  for (std::size_t first = 0; first < columns;) {
    const std::size_t count = std::min(max_units, columns - first), width = solve_width(count);
    x.assign(n * width, 0.0);
    for (std::size_t k = 0; k < n; ++k) {
      const double* const from = f.data() + first * n + static_cast<std::size_t>(permutation[k]);
      for (std::size_t j = 0; j < count; ++j)
        x[k * width + j] = from[j * n] + 0.0; // leaves no -0, whose sign zeros skipped would lose
    }
    work.resize(static_cast<std::size_t>(l.max_row_size) * width);
    solve_supernodal(state_->cpu)(arrays_of(l), x.data(), width, work.data());
    for (std::size_t k = 0; k < n; ++k) {
      double* const to = u.data() + first * n + static_cast<std::size_t>(permutation[k]);
      for (std::size_t j = 0; j < count; ++j)
        to[j * n] = x[k * width + j];
    }
    first += count;
  }
}

std::size_t Factor::solve_units(std::span<const std::int64_t> places,
                                std::vector<double>& x) const {
  const FactorView l = view();
  const std::size_t width = solve_width(std::max<std::size_t>(places.size(), 1));
  x.resize(order() * width);
  const std::vector<std::uint32_t> reached = reached_from(l, places);
  for (const std::uint32_t k : reached)
    std::fill(x.begin() + static_cast<std::ptrdiff_t>(width) * l.super[k],
              x.begin() + static_cast<std::ptrdiff_t>(width) * l.super[k + std::size_t{1}], 0.0);
  for (std::size_t c = 0; c < places.size(); ++c)
    x[static_cast<std::size_t>(places[c]) * width + c] = 1;
  std::vector<double> work(static_cast<std::size_t>(l.max_row_size) * width);
  solve_reached(state_->cpu)(arrays_of(l), reached, x.data(), width, work.data());
  return width;
}

void solve_unit_axes(const StiffnessMatrix& matrix, const Factor& factor,
                     std::span<const std::size_t> axes, std::span<double> u) {
  const std::span<const std::int64_t> permutation = factor.view().permutation;
  std::vector<std::int64_t> place_of_row(permutation.size());
  for (std::size_t k = 0; k < permutation.size(); ++k)
    place_of_row[static_cast<std::size_t>(permutation[k])] = static_cast<std::int64_t>(k);
  std::ranges::fill(u, 0.0);
  const std::size_t size = matrix.row_of_axis.size();
  std::vector<double> x;
  for (std::size_t first = 0; first < axes.size(); first += Factor::max_units) {
    std::vector<std::int64_t> places;
    std::vector<double*> columns;
    for (std::size_t c = first; c < std::min(first + Factor::max_units, axes.size()); ++c)
      if (const std::int64_t row = matrix.row_of_axis[axes[c]]; row >= 0) {
        places.push_back(place_of_row[static_cast<std::size_t>(row)]);
        columns.push_back(u.data() + c * size);
      }
    if (places.empty())
      continue;
    const std::size_t width = factor.solve_units(places, x);
    for (std::size_t k = 0; k < permutation.size(); ++k) {
      const auto axis =
          static_cast<std::size_t>(matrix.axis_of_row[static_cast<std::size_t>(permutation[k])]);
      for (std::size_t c = 0; c < columns.size(); ++c)
        columns[c][axis] = x[k * width + c];
    }
  }
}

void solve_axes(const StiffnessMatrix& matrix, const Factor& factor, std::span<const double> f,
                std::span<double> u) {
  std::vector<double> rows(matrix.order()), solved(matrix.order());
  for (std::size_t r = 0; r < rows.size(); ++r)
    rows[r] = f[static_cast<std::size_t>(matrix.axis_of_row[r])];
  factor.solve(rows, solved);
  std::fill(u.begin(), u.end(), 0.0);
  for (std::size_t r = 0; r < rows.size(); ++r)
    u[static_cast<std::size_t>(matrix.axis_of_row[r])] = solved[r];
}

} // namespace gewebe::linalg
