#include "linalg/frontal_factor.h"

#include "linalg/factor.h"
#include "linalg/frontal_factor_internal.h"

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

namespace gewebe::linalg {

using namespace frontal;

FrontalFactor::FrontalFactor(const model::Model& model, const Context& context)
    : state_(std::make_unique<State>()) {
  state_->begin({.model = &model}, context);
}

FrontalFactor::FrontalFactor(const NodeMatrix& matrix, const Context& context)
    : state_(std::make_unique<State>()) {
  state_->begin({.matrix = &matrix}, context);
}

FrontalFactor::FrontalFactor(const model::Model& model, cholesky::FrontTree tree,
                             const Context& context)
    : state_(std::make_unique<State>()) {
  state_->begin({.model = &model}, std::move(tree), context);
}

FrontalFactor::FrontalFactor(const NodeMatrix& matrix, cholesky::FrontTree tree,
                             const Context& context)
    : state_(std::make_unique<State>()) {
  state_->begin({.matrix = &matrix}, std::move(tree), context);
}

FrontalFactor::~FrontalFactor() = default;
FrontalFactor::FrontalFactor(FrontalFactor&&) noexcept = default;
FrontalFactor& FrontalFactor::operator=(FrontalFactor&&) noexcept = default;

cholesky::FrontalWork FrontalFactor::refactor(const model::Model& model,
                                              std::span<const std::uint32_t> origin,
                                              std::span<const std::uint32_t> place,
                                              const Context& context) {
  state_->refactor({.model = &model}, origin, place, {}, context);
  return state_->work;
}

cholesky::FrontalWork FrontalFactor::refactor(const NodeMatrix& matrix,
                                              std::span<const std::uint32_t> origin,
                                              std::span<const std::uint32_t> place,
                                              std::span<const std::uint32_t> rows,
                                              const Context& context) {
  state_->refactor({.matrix = &matrix}, origin, place, rows, context);
  return state_->work;
}

const cholesky::FrontTree& FrontalFactor::tree() const noexcept {
  return state_->tree;
}

std::size_t FrontalFactor::axes() const noexcept {
  return 3 * state_->graph.axes.size();
}

std::size_t FrontalFactor::entries() const noexcept {
  return state_->entries;
}

const cholesky::FrontalWork& FrontalFactor::work() const noexcept {
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
    solve_supernodal(s.cpu)(l, x.data(), width, work.data());
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
  const auto x = std::make_unique_for_overwrite<double[]>(
      s.axis_of_row.size() * solve_width(3 * std::min(at_once, nodes.size())));
  std::vector<double> work;
  std::vector<std::uint32_t> blocks;
  for (std::size_t first = 0; first < nodes.size(); first += at_once) {
    const std::size_t count = std::min(at_once, nodes.size() - first);
    const std::size_t width = solve_width(3 * count);
    blocks.clear();
    work.resize(s.blocks.longest * width);
    for (std::size_t k = 0; k < count; ++k) {
      all[first + k].front = s.front_of_node(nodes[first + k]);
      for (std::uint32_t f = all[first + k].front; f != none; f = s.tree.parent[f])
        for (std::uint32_t b = s.blocks.first[f]; b < s.blocks.first[f + std::size_t{1}]; ++b)
          blocks.push_back(b);
    }
    std::sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    for (const std::uint32_t b : blocks) // what is on the ways reaches nothing else
      std::fill(x.get() + static_cast<std::size_t>(s.blocks.super[b]) * width,
                x.get() + static_cast<std::size_t>(s.blocks.super[b + std::size_t{1}]) * width,
                0.0);
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t node = nodes[first + k], row = s.row_of_node[node];
      for (std::uint32_t a = 0; row != none && a < s.graph.axes[node]; ++a)
        x[(row + a) * width + 3 * k + s.axis_of_row[row + a] % 3] = 1;
    }
    forward_supernodal(s.cpu)(s.arrays(), blocks, x.get(), width, work.data());
    for (std::size_t k = 0; k < count; ++k) {
      ForwardSolve& solution = all[first + k];
      if (solution.front != none)
        solution.values.reserve(s.to_root[solution.front]);
      for (std::uint32_t f = solution.front; f != none; f = s.tree.parent[f])
        for (std::size_t row = s.first_row(f); row < s.first_row(f + std::size_t{1}); ++row) {
          const double* const values = x.get() + row * width + 3 * k;
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

std::size_t FrontalFactor::carry(std::span<const double> over_axes) {
  return state_->carry(over_axes);
}

std::array<double, 3> FrontalFactor::carried(const ForwardSolve& at) const {
  std::array<double, 3> u{};
  const auto* value = at.values.data();
  for (std::uint32_t f = at.front; f != none; f = state_->tree.parent[f])
    for (std::size_t c = 0; c < state_->fronts[f].columns; ++c, ++value)
      for (std::size_t a = 0; a < 3; ++a)
        u[a] += (*value)[a] * state_->loads[f].values[c];
  return u;
}

} // namespace gewebe::linalg
