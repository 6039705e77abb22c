#include "solve/frontal_factor.h"

#include "base/parallel.h"
#include "solve/condition.h"
#include "solve/factor.h"
#include "solve/front_tree.h"
#include "solve/ordering.h"
#include "solve/spring_graph.h"
#include "solve/stiffness.h"
#include "solve/supernodal_solve_internal.h"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <tuple>
#include <utility>

// Based on: Liu, The multifrontal method for sparse matrix solution: theory and practice, 1992.

namespace gewebe {

namespace {

constexpr std::uint32_t none = FrontTree::none;
constexpr std::array<std::array<std::size_t, 3>, 3> entry{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};

/// The free axes of a node.
struct FreeAxes {
  std::array<std::uint8_t, 3> axis{};
  std::uint8_t count = 0;
};

/// By the set of fixed ones.
constexpr std::array<FreeAxes, 8> all_free_axes = [] {
  std::array<FreeAxes, 8> all;
  for (std::uint8_t set = 0; set < 8; ++set)
    for (std::uint8_t a = 0; a < 3; ++a)
      if ((set >> a & 1) == 0)
        all[set].axis[all[set].count++] = a;
  return all;
}();

/// What K is made of: springs of a model, or a matrix.
struct Source {
  const Model* model = nullptr;
  const NodeMatrix* matrix = nullptr;

  std::size_t nodes() const { return model != nullptr ? model->nodes.size() : matrix->nodes(); }
  std::uint8_t fixed(std::size_t node) const {
    return model != nullptr ? model->nodes[node].fixed : matrix->fixed[node];
  }
  SpringGraph graph() const {
    if (model != nullptr)
      return spring_graph(*model);
    return {matrix->start, matrix->node, matrix->at, matrix->axes};
  }
};

const FreeAxes& free_axes(const Source& k, std::uint32_t node) {
  return all_free_axes[k.fixed(node) & 7U];
}

/// 0, 1, 2 …: nothing has moved.
bool ascend_by_one(std::span<const std::uint32_t> numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (numbers[i] != i)
      return false;
  return true;
}

} // namespace

struct FrontalFactor::State {
  FrontTree tree;
  std::vector<Front> fronts;
  std::vector<FrontMemory> memory; // of L of each front
  FrontalWork work;
  CpuLevel cpu = CpuLevel::baseline;

  // Of the model as it was factorised, to tell what changed.
  SpringGraph graph;
  std::vector<Spring> springs;
  std::vector<Vec3> position;
  std::vector<std::uint8_t> fixed;

  // L as the solver wants it.
  FrontBlocks blocks;
  std::vector<const double*> values; // of each block
  std::vector<std::uint32_t> axis_of_row;
  std::vector<std::uint32_t> row_of_node; // the first of its axes, or none
  std::vector<std::uint32_t> to_root;     // rows eliminated by a front and all above it
  std::size_t entries = 0;
  double weakest = 1;
  std::size_t weakest_row = 0;

  /// The rows of the nodes that a front eliminates.
  void assemble(const Source& k, const FrontAssembly& to) const {
    const std::uint32_t first = tree.first[to.front], last = tree.first[to.front + 1];
    std::vector<SymmetricBlock> diagonals(last - first);
    if (k.model != nullptr)
      add_springs(k, to, diagonals);
    else
      add_blocks(k, to, diagonals);
    to.min_pivot.clear();
    for (std::uint32_t at = first; at < last; ++at) {
      const std::uint32_t node = tree.sequence[at];
      const FreeAxes& free = free_axes(k, node);
      const SymmetricBlock& diagonal = diagonals[at - first];
      for (std::size_t a = 0; a < free.count; ++a) {
        for (std::size_t b = a; b < free.count; ++b)
          to.at(to.row[node] + b, to.row[node] + a) += diagonal[entry[free.axis[a]][free.axis[b]]];
        to.min_pivot.push_back(diagonal[entry[free.axis[a]][free.axis[a]]] / max_condition);
      }
    }
  }

  /// Each block between two nodes of the front comes once.
  void add_blocks(const Source& k, const FrontAssembly& to,
                  std::vector<SymmetricBlock>& diagonals) const {
    const std::uint32_t first = tree.first[to.front], last = tree.first[to.front + 1];
    for (std::uint32_t at = first; at < last; ++at) {
      const std::uint32_t node = tree.sequence[at];
      const FreeAxes& free = free_axes(k, node);
      diagonals[at - first] = k.matrix->diagonal[node];
      for (std::size_t arm = graph.start[node]; arm < graph.start[node + std::size_t{1}]; ++arm) {
        const std::uint32_t end = graph.node[arm], there = tree.position[end];
        if (there == none || there < at)
          continue;
        const std::array<double, 9>& block = k.matrix->block[graph.spring[arm]];
        const FreeAxes& other = free_axes(k, end);
        for (std::size_t a = 0; a < free.count; ++a)
          for (std::size_t b = 0; b < other.count; ++b)
            to.at(to.row[end] + b, to.row[node] + a) +=
                block[3 * std::size_t{free.axis[a]} + other.axis[b]];
      }
    }
  }

  /// Springs of the nodes that a front eliminates; each spring between two of them comes once.
  void add_springs(const Source& k, const FrontAssembly& to,
                   std::vector<SymmetricBlock>& diagonals) const {
    const Model& model = *k.model;
    const std::uint32_t first = tree.first[to.front], last = tree.first[to.front + 1];
    const auto add_diagonal = [&](std::uint32_t place, const SymmetricBlock& block) {
      for (std::size_t n = 0; n < 6; ++n)
        diagonals[place - first][n] += block[n];
    };
    for (std::uint32_t at = first; at < last; ++at) {
      const std::uint32_t node = tree.sequence[at];
      const FreeAxes& free = free_axes(k, node);
      for (std::size_t arm = graph.start[node]; arm < graph.start[node + std::size_t{1}]; ++arm) {
        const std::uint32_t end = graph.node[arm], there = tree.position[end];
        if (there != none && first <= there && there < at)
          continue;
        const SymmetricBlock block = stiffness_block(model, model.springs[graph.spring[arm]]);
        add_diagonal(at, block);
        if (there == none || there < first)
          continue;
        if (there < last)
          add_diagonal(there, block);
        const FreeAxes& other = free_axes(k, end);
        for (std::size_t a = 0; a < free.count; ++a)
          for (std::size_t b = 0; b < other.count; ++b)
            to.at(to.row[end] + b, to.row[node] + a) -= block[entry[free.axis[a]][other.axis[b]]];
      }
    }
  }

  std::size_t axis_at(const Source& k, std::size_t f, std::size_t row) const {
    for (const std::uint32_t node : tree.eliminated(f)) {
      if (row < graph.axes[node])
        return 3 * std::size_t{node} + free_axes(k, node).axis[row];
      row -= graph.axes[node];
    }
    return 0;
  }

  /// Computes the fronts that are wanted (all, where that is empty).
  void factorise(const Source& k, std::span<const char> wanted, const Context& context) {
    const std::size_t size = measure_fronts(tree, graph.axes, fronts);
    require_memory(context,
                   8 * static_cast<double>(size) +
                       update_bytes(tree, fronts, true, thread_count(context)),
                   "the factor of the stiffness matrix");
    memory.resize(tree.fronts());
    for (std::size_t f = 0; f < tree.fronts(); ++f)
      fronts[f].l = memory[f].reserve(fronts[f].entries(), true);
    try {
      work = gewebe::factorise({.tree = tree,
                                .axes = graph.axes,
                                .fronts = fronts,
                                .assemble = [&](const FrontAssembly& to) { assemble(k, to); },
                                .keep_updates = true},
                               wanted, context);
    } catch (const PivotTooSmall& pivot) {
      throw NotPositiveDefinite(axis_at(k, pivot.front, pivot.column));
    }
  }

  void lay_out(const Source& k) {
    const std::size_t count = tree.fronts();
    values.clear();
    axis_of_row.clear();
    entries = 0;
    row_of_node.assign(graph.axes.size(), none);
    for (const std::uint32_t node : tree.sequence) {
      row_of_node[node] = static_cast<std::uint32_t>(axis_of_row.size());
      const FreeAxes& free = free_axes(k, node);
      for (std::size_t a = 0; a < free.count; ++a)
        axis_of_row.push_back(3 * node + free.axis[a]);
    }
    blocks = front_blocks(tree, graph.axes, fronts);
    for (const Front& front : fronts) {
      for (std::size_t c = 0; c < front.columns; c += front_block)
        values.push_back(front.l + front_offset(front.rows, c));
      entries += front.entries();
    }
    find_weakest();
    to_root.resize(count);
    for (std::size_t f = count; f-- > 0;)
      to_root[f] = static_cast<std::uint32_t>(fronts[f].columns) +
                   (tree.parent[f] == none ? 0 : to_root[tree.parent[f]]);
  }

  SupernodalArrays arrays() const {
    return {blocks.super.size() - 1,
            blocks.super.data(),
            blocks.pi.data(),
            nullptr,
            blocks.s.data(),
            nullptr,
            values.data()};
  }

  /// The first of the rows of L that a front eliminates.
  std::size_t first_row(std::size_t front) const {
    return static_cast<std::size_t>(blocks.super[blocks.first[front]]);
  }

  std::uint32_t front_of_node(std::uint32_t node) const {
    if (row_of_node[node] == none)
      return none;
    const auto above = std::ranges::upper_bound(tree.first, tree.position[node]);
    return static_cast<std::uint32_t>(above - tree.first.begin() - 1);
  }

  void find_weakest() {
    weakest = 1;
    weakest_row = 0;
    for (std::size_t f = 0; f < fronts.size(); ++f)
      if (const double pivot = fronts[f].weakest / max_condition; pivot < weakest) {
        weakest = pivot;
        weakest_row = first_row(f) + fronts[f].weakest_column;
      }
  }

  void remember(const Source& k) {
    fixed.resize(k.nodes());
    for (std::size_t i = 0; i < fixed.size(); ++i)
      fixed[i] = k.fixed(i);
    if (k.model == nullptr)
      return;
    springs = k.model->springs;
    position.resize(fixed.size());
    for (std::size_t i = 0; i < fixed.size(); ++i)
      position[i] = k.model->nodes[i].position;
  }

  /// All anew, in an order of its own finding.
  void begin(const Source& k, const Context& context) {
    cpu = context.cpu;
    graph = k.graph();
    const std::vector<std::uint32_t> order = elimination_order(graph.view());
    if (order.empty())
      throw Error("every node is fixed along every axis, expected a node that can move");
    tree = front_tree(graph.view(), order);
    fronts = std::vector<Front>(tree.fronts());
    factorise(k, {}, context);
    lay_out(k);
    remember(k);
  }

  // ---- changes

  /// Whether each node is held along the axes along which it was.
  bool held_alike(const Source& k, std::span<const std::uint32_t> origin,
                  std::span<const std::uint32_t> place) const {
    for (std::size_t i = 0; i < k.nodes(); ++i) {
      const std::uint32_t old = origin.empty() ? static_cast<std::uint32_t>(i) : origin[i];
      const bool put = k.matrix != nullptr && !place.empty() && place[old] != i;
      if (!put && k.fixed(i) != fixed[old])
        return false;
    }
    return true;
  }

  /// By node: whether its row of K is other than it was, its neighbours' numbers aside. Both lists
  /// of springs ascend alike where nodes keep their order, so one pass finds what differs; in
  /// another order more of them seem changed than are.
  std::vector<char> changed_rows(const Model& model, std::span<const std::uint32_t> origin,
                                 std::span<const std::uint32_t> place) const {
    const std::size_t n = model.nodes.size();
    std::vector<char> changed(n, 0), moved(n, 0);
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t old = origin.empty() ? i : origin[i];
      const bool copy = !place.empty() && place[old] != i;
      moved[i] = !(model.nodes[i].position == position[old]);
      changed[i] = copy || moved[i];
    }
    const auto mark = [&](std::uint32_t node) {
      if (node != none)
        changed[node] = 1;
    };
    const auto placed = [&](std::uint32_t old) { return place.empty() ? old : place[old]; };
    std::size_t b = 0;
    for (const Spring& was : springs) {
      const std::uint32_t i = placed(was.i), j = placed(was.j);
      const auto key = std::tuple(was.kind, i, j);
      for (; b < model.springs.size(); ++b) {
        const Spring& is = model.springs[b];
        if (i == none || j == none || !(std::tie(is.kind, is.i, is.j) < key))
          break;
        mark(is.i);
        mark(is.j);
      }
      if (i != none && j != none && b < model.springs.size()) {
        const Spring& is = model.springs[b];
        if (std::tie(is.kind, is.i, is.j) == key) {
          ++b;
          if (is.stiffness == was.stiffness && is.rest == was.rest && !moved[i] && !moved[j])
            continue;
        }
      }
      mark(i);
      mark(j);
    }
    for (; b < model.springs.size(); ++b) {
      mark(model.springs[b].i);
      mark(model.springs[b].j);
    }
    return changed;
  }

  /// Whether the tree serves this graph too: the same nodes free, and no spring where none was.
  bool still_fits(const SpringGraph& now, std::span<const std::uint32_t> place) const {
    if (!place.empty() || now.axes != graph.axes)
      return false;
    std::vector<std::uint32_t> mark(now.axes.size(), none);
    for (std::uint32_t i = 0; i < now.axes.size(); ++i) {
      for (const std::uint32_t other : graph.view().of(i))
        mark[other] = i;
      for (const std::uint32_t other : now.view().of(i))
        if (mark[other] != i)
          return false;
    }
    return true;
  }

  /// The order of elimination before, with what came since. A copy is eliminated right behind what
  /// it is a copy of, so that it fills as that does.
  std::vector<std::uint32_t> order_for(const SpringGraph& now,
                                       std::span<const std::uint32_t> origin,
                                       std::span<const std::uint32_t> place) const {
    const std::size_t n = now.axes.size();
    std::vector<std::uint32_t> copy(graph.axes.size(), none), next(n, none); // lists of copies
    for (std::size_t i = origin.size(); i-- > 0;)
      if (place[origin[i]] != i)
        next[i] = std::exchange(copy[origin[i]], static_cast<std::uint32_t>(i));
    std::vector<std::uint32_t> order;
    order.reserve(n);
    std::vector<char> ordered(n, 0);
    const auto put = [&](std::uint32_t node) {
      if (node == none || ordered[node])
        return;
      if (now.axes[node] > 0)
        order.push_back(node);
      ordered[node] = 1;
    };
    for (const std::uint32_t old : tree.sequence) {
      put(place.empty() ? old : place[old]);
      for (std::uint32_t c = copy[old]; c != none; c = next[c])
        put(c);
    }
    for (std::uint32_t i = 0; i < n; ++i) // what was not free before
      put(i);
    return order;
  }

  /// \param rows that are others, of a matrix
  void refactor(const Source& k, std::span<const std::uint32_t> origin,
                std::span<const std::uint32_t> place, std::span<const std::uint32_t> rows,
                const Context& context) {
    if (!held_alike(k, origin, place)) // rows come and go within fronts
      return begin(k, context);
    cpu = context.cpu;
    SpringGraph now = k.graph();
    const std::size_t n = k.nodes();
    if (n == graph.axes.size() && ascend_by_one(origin) && ascend_by_one(place))
      origin = place = {};
    std::vector<char> changed(n, 0);
    if (k.model != nullptr)
      changed = changed_rows(*k.model, origin, place);
    for (const std::uint32_t row : rows)
      changed[row] = 1;
    std::vector<char> wanted;
    if (still_fits(now, place)) {
      graph = std::move(now);
      wanted.assign(tree.fronts(), 0);
      for (std::size_t f = 0; f < tree.fronts(); ++f) {
        for (const std::uint32_t node : tree.eliminated(f))
          wanted[f] = static_cast<char>(wanted[f] | changed[node]);
        if (wanted[f] && tree.parent[f] != none)
          wanted[tree.parent[f]] = 1;
      }
      factorise(k, wanted, context);
      find_weakest();
    } else {
      const std::vector<std::uint32_t> order = order_for(now, origin, place);
      graph = std::move(now);
      wanted = grow(order, changed, place);
      factorise(k, wanted, context);
      lay_out(k);
    }
    remember(k);
  }

  /// The tree of this order, with the fronts that are as they were. \return which are not
  std::vector<char> grow(std::span<const std::uint32_t> order, const std::vector<char>& changed,
                         std::span<const std::uint32_t> place) {
    const FrontTree before = std::exchange(tree, front_tree(graph.view(), order));
    std::vector<Front> had = std::exchange(fronts, std::vector<Front>(tree.fronts()));
    std::vector<FrontMemory> held = std::exchange(memory, std::vector<FrontMemory>(tree.fronts()));
    const auto placed = [&](std::uint32_t old) { return place.empty() ? old : place[old]; };
    // Old fronts by the first node that they eliminated.
    std::vector<std::uint32_t> front_of(graph.axes.size(), none);
    for (std::uint32_t f = 0; f < before.fronts(); ++f)
      if (const std::uint32_t node = placed(before.eliminated(f)[0]); node != none)
        front_of[node] = f;
    const auto same = [&](std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) {
      return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                        [&](std::uint32_t x, std::uint32_t y) { return x == placed(y); });
    };
    // A front is as it was only with the children that it had. Where springs went while the tree
    // stayed, a child may hang elsewhere now though no row of this front has changed since.
    std::vector<std::uint32_t> had_children(before.fronts(), 0), kept_children(tree.fronts(), 0);
    for (const std::uint32_t parent : before.parent)
      if (parent != none)
        ++had_children[parent];
    std::vector<char> wanted(tree.fronts(), 0);
    for (std::size_t f = 0; f < tree.fronts(); ++f) {
      const auto own = tree.eliminated(f);
      const std::uint32_t old = front_of[own[0]], parent = tree.parent[f];
      if (old != none) { // if only for its memory
        fronts[f] = std::move(had[old]);
        memory[f] = std::move(held[old]);
      }
      const bool kept =
          !wanted[f] && old != none && kept_children[f] == had_children[old] &&
          same(own, before.eliminated(old)) && same(tree.boundary_of(f), before.boundary_of(old)) &&
          std::none_of(own.begin(), own.end(), [&](std::uint32_t i) { return changed[i] != 0; });
      wanted[f] = !kept;
      if (parent == none)
        continue;
      const bool stays = kept && before.parent[old] != none &&
                         before.parent[old] == front_of[tree.eliminated(parent)[0]];
      kept_children[parent] += stays ? 1 : 0;
      wanted[parent] = static_cast<char>(wanted[parent] | !stays);
    }
    return wanted;
  }
};

FrontalFactor::FrontalFactor(const Model& model, const Context& context)
    : state_(std::make_unique<State>()) {
  state_->begin({.model = &model}, context);
}

FrontalFactor::FrontalFactor(const NodeMatrix& matrix, const Context& context)
    : state_(std::make_unique<State>()) {
  state_->begin({.matrix = &matrix}, context);
}

FrontalFactor::~FrontalFactor() = default;
FrontalFactor::FrontalFactor(FrontalFactor&&) noexcept = default;
FrontalFactor& FrontalFactor::operator=(FrontalFactor&&) noexcept = default;

FrontalWork FrontalFactor::refactor(const Model& model, std::span<const std::uint32_t> origin,
                                    std::span<const std::uint32_t> place, const Context& context) {
  state_->refactor({.model = &model}, origin, place, {}, context);
  return state_->work;
}

FrontalWork FrontalFactor::refactor(const NodeMatrix& matrix, std::span<const std::uint32_t> origin,
                                    std::span<const std::uint32_t> place,
                                    std::span<const std::uint32_t> rows, const Context& context) {
  state_->refactor({.matrix = &matrix}, origin, place, rows, context);
  return state_->work;
}

std::size_t FrontalFactor::axes() const noexcept {
  return 3 * state_->graph.axes.size();
}

std::size_t FrontalFactor::entries() const noexcept {
  return state_->entries;
}

const FrontalWork& FrontalFactor::work() const noexcept {
  return state_->work;
}

double FrontalFactor::weakest_pivot() const noexcept {
  return state_->weakest;
}

std::size_t FrontalFactor::weakest_axis() const noexcept {
  return state_->axis_of_row[state_->weakest_row];
}

void FrontalFactor::solve(std::span<double> over_axes, std::size_t columns) const {
  const State& s = *state_;
  const SupernodalArrays l = s.arrays();
  const std::size_t order = s.axis_of_row.size(), all = axes();
  std::vector<double> x, work;
  for (std::size_t first = 0; first < columns;) {
    const std::size_t count = std::min(Factor::max_units, columns - first);
    const std::size_t width = solve_width(count);
    x.assign(order * width, 0.0);
    work.resize(s.blocks.longest * width);
    double* const from = over_axes.data() + first * all;
    for (std::size_t k = 0; k < order; ++k)
      for (std::size_t j = 0; j < count; ++j)
        x[k * width + j] = from[j * all + s.axis_of_row[k]] + 0.0; // no -0
    (s.cpu == CpuLevel::baseline ? solve_supernodal_baseline
                                 : solve_supernodal_avx2)(l, x.data(), width, work.data());
    std::fill_n(from, count * all, 0.0);
    for (std::size_t k = 0; k < order; ++k)
      for (std::size_t j = 0; j < count; ++j)
        from[j * all + s.axis_of_row[k]] = x[k * width + j];
    first += count;
  }
}

std::vector<FrontalFactor::ForwardSolve>
FrontalFactor::forward_solves(std::span<const std::uint32_t> nodes) const {
  constexpr std::size_t at_once = panel_width;
  const State& s = *state_;
  std::vector<ForwardSolve> all(nodes.size());
  std::vector<double> x, work;
  std::vector<std::uint32_t> blocks;
  for (std::size_t first = 0; first < nodes.size(); first += at_once) {
    const std::size_t count = std::min(at_once, nodes.size() - first);
    const std::size_t width = solve_width(3 * count);
    blocks.clear();
    x.assign(s.axis_of_row.size() * width, 0.0);
    work.resize(s.blocks.longest * width);
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t node = nodes[first + k], row = s.row_of_node[node];
      all[first + k].front = s.front_of_node(node);
      for (std::uint32_t f = all[first + k].front; f != none; f = s.tree.parent[f])
        for (std::uint32_t b = s.blocks.first[f]; b < s.blocks.first[f + std::size_t{1}]; ++b)
          blocks.push_back(b);
      for (std::uint32_t a = 0; row != none && a < s.graph.axes[node]; ++a)
        x[(row + a) * width + 3 * k + s.axis_of_row[row + a] % 3] = 1;
    }
    std::sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    (s.cpu == CpuLevel::baseline ? forward_supernodal_baseline : forward_supernodal_avx2)(
        s.arrays(), blocks, x.data(), width, work.data());
    for (std::size_t k = 0; k < count; ++k) {
      ForwardSolve& solution = all[first + k];
      if (solution.front != none)
        solution.values.reserve(s.to_root[solution.front]);
      for (std::uint32_t f = solution.front; f != none; f = s.tree.parent[f])
        for (std::size_t row = s.first_row(f); row < s.first_row(f + std::size_t{1}); ++row) {
          const double* const values = x.data() + row * width + 3 * k;
          solution.values.push_back({values[0], values[1], values[2]});
        }
    }
  }
  return all;
}

std::array<std::array<double, 3>, 3> FrontalFactor::compliance(const ForwardSolve& a,
                                                               const ForwardSolve& b) const {
  std::array<std::array<double, 3>, 3> block{};
  std::uint32_t f = a.front, g = b.front; // to where both ways meet
  while (f != g && f != none && g != none)
    (f < g ? f : g) = state_->tree.parent[std::min(f, g)];
  if (f != g || f == none)
    return block; // in different trees, or fixed
  const std::size_t common = state_->to_root[f];
  const auto* const p = a.values.data() + (a.values.size() - common);
  const auto* const q = b.values.data() + (b.values.size() - common);
  for (std::size_t k = 0; k < common; ++k)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        block[i][j] += p[k][i] * q[k][j];
  return block;
}

} // namespace gewebe
