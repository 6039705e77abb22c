// Fronts of a factor: what K gives them, how they are computed and laid out for solves.

#include "base/parallel.h"
#include "cholesky/ordering.h"
#include "linalg/condition.h"
#include "linalg/factor.h"
#include "linalg/frontal_factor_internal.h"

#include <algorithm>
#include <utility>

// Based on: Liu, The multifrontal method for sparse matrix solution: theory and practice, 1992.

namespace gewebe::linalg {

using namespace frontal;

namespace {

constexpr std::array<std::array<std::size_t, 3>, 3> entry{{{0, 1, 2}, {1, 3, 4}, {2, 4, 5}}};

} // namespace

void FrontalFactor::State::assemble(const Source& k, const cholesky::FrontAssembly& to) const {
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

void FrontalFactor::State::add_blocks(const Source& k, const cholesky::FrontAssembly& to,
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

void FrontalFactor::State::add_springs(const Source& k, const cholesky::FrontAssembly& to,
                                       std::vector<SymmetricBlock>& diagonals) const {
  const model::Model& model = *k.model;
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

std::size_t FrontalFactor::State::axis_at(const Source& k, std::size_t f, std::size_t row) const {
  for (const std::uint32_t node : tree.eliminated(f)) {
    if (row < graph.axes[node])
      return 3 * std::size_t{node} + free_axes(k, node).axis[row];
    row -= graph.axes[node];
  }
  return 0;
}

void FrontalFactor::State::factorise(const Source& k, std::span<const char> selected,
                                     const Context& context) {
  const std::size_t size = cholesky::measure_fronts(tree, graph.axes, fronts);
  require_memory(context,
                 8 * static_cast<double>(size) +
                     cholesky::update_bytes(tree, fronts, true, thread_count(context)),
                 "the factor of the stiffness matrix");
  memory.resize(tree.fronts());
  for (std::size_t f = 0; f < tree.fronts(); ++f)
    fronts[f].l = memory[f].reserve(fronts[f].entries(), true);
  try {
    work = gewebe::cholesky::factorise(
        {.tree = tree,
         .axes = graph.axes,
         .fronts = fronts,
         .assemble = [&](const cholesky::FrontAssembly& to) { assemble(k, to); },
         .keep_updates = true},
        selected, context);
  } catch (const cholesky::PivotTooSmall& pivot) {
    throw NotPositiveDefinite(axis_at(k, pivot.front, pivot.column));
  }
  for (std::size_t f = 0; f < loads.size(); ++f)
    if (selected.empty() || selected[f] != 0)
      loads[f].current = false;
}

void FrontalFactor::State::lay_out(const Source& k) {
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
  blocks = cholesky::front_blocks(tree, graph.axes, fronts);
  for (const cholesky::Front& front : fronts) {
    for (std::size_t c = 0; c < front.columns; c += cholesky::front_block)
      values.push_back(front.l + cholesky::front_offset(front.rows, c));
    entries += front.entries();
  }
  find_weakest();
  to_root.resize(count);
  for (std::size_t f = count; f-- > 0;)
    to_root[f] = static_cast<std::uint32_t>(fronts[f].columns) +
                 (tree.parent[f] == none ? 0 : to_root[tree.parent[f]]);
}

SupernodalArrays FrontalFactor::State::arrays() const {
  return {blocks.super.size() - 1,
          blocks.super.data(),
          blocks.pi.data(),
          nullptr,
          blocks.s.data(),
          nullptr,
          values.data()};
}

std::size_t FrontalFactor::State::first_row(std::size_t front) const {
  return static_cast<std::size_t>(blocks.super[blocks.first[front]]);
}

std::uint32_t FrontalFactor::State::front_of_node(std::uint32_t node) const {
  if (row_of_node[node] == none)
    return none;
  const auto above = std::ranges::upper_bound(tree.first, tree.position[node]);
  return static_cast<std::uint32_t>(above - tree.first.begin() - 1);
}

void FrontalFactor::State::find_weakest() {
  weakest = 1;
  weakest_row = 0;
  for (std::size_t f = 0; f < fronts.size(); ++f)
    if (const double pivot = fronts[f].weakest / max_condition; pivot < weakest) {
      weakest = pivot;
      weakest_row = first_row(f) + fronts[f].weakest_column;
    }
}

void FrontalFactor::State::remember(const Source& k) {
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

void FrontalFactor::State::begin(const Source& k, const Context& context) {
  const SpringGraph of = k.graph();
  const std::vector<std::uint32_t> order = cholesky::elimination_order(of.view());
  if (order.empty())
    throw Error("every node is fixed along every axis, expected a node that can move");
  begin(k, cholesky::front_tree(of.view(), order), context);
}

void FrontalFactor::State::begin(const Source& k, cholesky::FrontTree with,
                                 const Context& context) {
  cpu = context.cpu;
  graph = k.graph();
  tree = std::move(with);
  fronts = std::vector<cholesky::Front>(tree.fronts());
  loads.clear();
  factorise(k, {}, context);
  lay_out(k);
  remember(k);
}

} // namespace gewebe::linalg
