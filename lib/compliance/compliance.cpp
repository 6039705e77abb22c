#include "compliance/compliance.h"

#include "base/error.h"
#include "columns/compressed_columns.h"
#include "columns/costs.h"
#include "compliance/forward_blocks.h"
#include "geometry/vector_at.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

namespace gewebe::compliance {

namespace {

constexpr double max_column_bytes = 1073741824; // where memory is not bounded

double column_bytes(const Context& context) {
  return std::min(static_cast<double>(context.max_memory) / 4, max_column_bytes);
}

std::vector<std::uint32_t> nodes_of(std::span<const contact::NodeVector> forces) {
  std::vector<std::uint32_t> nodes;
  nodes.reserve(forces.size());
  for (const contact::NodeVector& f : forces)
    nodes.push_back(f.node);
  return nodes;
}

/// m, of the source's columns.
std::size_t row_nodes_of(const model::Model& model, const ComplianceSource& source) {
  const columns::ColumnSource* const columns = source.columns();
  const std::size_t all = model.nodes.size();
  if (columns == nullptr || columns->row_nodes() == all)
    return all;
  if (const std::size_t surface = model::surface_count(model); columns->row_nodes() != surface)
    throw Error("the columns have rows for " + std::to_string(columns->row_nodes()) +
                " nodes, expected the " + std::to_string(surface) + " of the surface or all " +
                std::to_string(all));
  return columns->row_nodes();
}

/// Whether all nodes that can move and have rows have columns.
bool have_all_columns(const model::Model& model, const columns::CompressedColumns& columns) {
  for (std::uint32_t node = 0; node < columns.row_nodes(); ++node)
    if (model.nodes[node].fixed != model::fixed_all && !columns.has(node))
      return false;
  return true;
}

} // namespace

Compliance::Compliance(const model::Model& model, std::shared_ptr<ComplianceSource> source,
                       const Context& context, bool bounded, bool may_be_free)
    : axes_(3 * model.nodes.size()), source_(source ? std::move(source) : compliance_of_model()),
      compressed_(source_->columns() != nullptr ? source_->columns()->compressed() : nullptr),
      whole_(compressed_ != nullptr && have_all_columns(model, *compressed_) ? compressed_
                                                                             : nullptr),
      rows_(3 * row_nodes_of(model, *source_)), context_(context),
      cache_(rows_ / 3, source_->columns(), columns_of(rows_), column_bytes(context), bounded) {
  context_.progress = nullptr;
  if (rows_ < axes_)
    inside_.emplace(axes_ / 3, nullptr, columns_of(axes_), column_bytes(context) / 2, false);
  source_->set_warm(false); // nothing is done for this one yet
  try {
    source_->open(model, context_);
  } catch (const linalg::SingularStiffness& error) {
    if (!may_be_free)
      throw;
    free_ = error;
  }
}

Compliance::Past Compliance::past() const {
  return {.outer = cache_.past(),
          .inside = inside_ ? std::optional(inside_->past()) : std::nullopt,
          .warm = source_->is_warm()};
}

void Compliance::restore(const Past& past) {
  cache_.restore(past.outer);
  if (inside_)
    inside_->restore(*past.inside);
  source_->set_warm(past.warm);
}

void Compliance::require_held() const {
  if (free_)
    throw linalg::SingularStiffness(*free_);
}

/// Solves for columns, and keeps so many rows of them.
columns::ColumnSolve Compliance::columns_of(std::size_t rows) {
  return [this, rows](std::span<const std::uint32_t> nodes, std::span<double> columns) {
    std::vector<double> whole;
    if (rows < axes_)
      whole.resize(3 * axes_ * nodes.size());
    const std::span<double> all = rows < axes_ ? std::span(whole) : columns;
    std::fill(all.begin(), all.end(), 0.0);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      for (std::size_t a = 0; a < 3; ++a)
        all[(3 * k + a) * axes_ + 3 * std::size_t{nodes[k]} + a] = 1;
    solve(all, 3 * nodes.size());
    for (std::size_t c = 0; rows < axes_ && c < 3 * nodes.size(); ++c)
      std::ranges::copy(all.subspan(c * axes_, rows), columns.subspan(c * rows, rows).begin());
  };
}

void Compliance::solve(std::span<double> over_axes, std::size_t columns) {
  require_held();
  source_->solve(over_axes, columns);
  solves_ += columns;
}

void Compliance::need(std::span<const std::uint32_t> nodes) {
  if (compressed_ == nullptr && !inside_)
    return cache_.need(nodes);
  std::vector<std::uint32_t> first, others;
  for (const std::uint32_t node : nodes)
    if (!compressed(node))
      (outer(node) ? first : others).push_back(node);
  cache_.need(first);
  if (inside_)
    inside_->need(others);
}

void Compliance::prepare(std::span<const std::uint32_t> nodes) {
  std::vector<std::uint32_t> some;
  for (const std::uint32_t node : nodes)
    if (!compressed(node) && outer(node))
      some.push_back(node);
  cache_.prepare(some);
}

void Compliance::read_compressed() const {
  if (compressed_ != nullptr)
    compressed_->read_all();
}

bool Compliance::fit(std::span<const std::uint32_t> nodes) const {
  const auto others = static_cast<std::size_t>(
      std::count_if(nodes.begin(), nodes.end(), [&](std::uint32_t node) { return !outer(node); }));
  return nodes.size() - others <= capacity() && (others == 0 || others <= inside_->capacity());
}

double Compliance::entry(std::uint32_t node, int axis, std::size_t row) const {
  if (!outer(node))
    return inside_->entry(node, axis, row);
  if (row < rows_)
    return compressed(node) ? compressed_->entry(node, axis, row) : cache_.entry(node, axis, row);
  return inside_->entry(static_cast<std::uint32_t>(row / 3), static_cast<int>(row % 3),
                        axis_of(node, axis)); // C is symmetric
}

void Compliance::need_blocks(std::span<const std::uint32_t> nodes) {
  if (ForwardBlocks* const blocks = source_->blocks(); blocks != nullptr)
    blocks->need(nodes);
  else
    need(nodes);
}

ComplianceBlock Compliance::block(std::uint32_t node, std::uint32_t other) const {
  if (const ForwardBlocks* const blocks = source_->blocks(); blocks != nullptr)
    return blocks->block(node, other);
  return column_block(node, other);
}

ComplianceBlock Compliance::column_block(std::uint32_t node, std::uint32_t other) const {
  if (compressed(node) && outer(other))
    return compressed_->block(node, other);
  ComplianceBlock block{};
  for (int a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b)
      block[static_cast<std::size_t>(a)][b] = entry(node, a, 3 * std::size_t{other} + b);
  return block;
}

std::vector<Vec3> Compliance::carried(std::span<const double> over_axes,
                                      std::span<const std::uint32_t> nodes) {
  return source_->blocks()->answers(over_axes, nodes);
}

bool Compliance::compressed(std::uint32_t node) const {
  return compressed_ != nullptr && compressed_->has(node);
}

std::size_t Compliance::capacity() const noexcept {
  return compressed_ == nullptr ? cache_.capacity()
                                : std::max(cache_.capacity(), compressed_->nodes().size());
}

void Compliance::add_rows(std::span<const contact::NodeVector> forces,
                          std::span<const std::size_t> rows, std::span<double> values) {
  need(nodes_of(forces));
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (const contact::NodeVector& f : forces)
      for (int a = 0; a < 3; ++a)
        values[k] += entry(f.node, a, rows[k]) * f.value[a];
}

columns::EntryBound Compliance::bound(std::span<const contact::NodeVector> forces) const {
  const columns::ColumnSource* const columns = source_->columns();
  if (columns == nullptr)
    return {};
  columns::EntryBound bound = columns->bound();
  if (bound.entry == 0)
    return {};
  double size = 0; // of forces that take part in a sum of stored columns
  for (const contact::NodeVector& f : forces)
    if (std::ranges::binary_search(columns->nodes(), f.node))
      for (int a = 0; a < 3; ++a)
        size += std::abs(f.value[a]);
  bound.entry *= size;
  return bound;
}

bool Compliance::stored(std::span<const std::uint32_t> nodes) const {
  return std::all_of(nodes.begin(), nodes.end(), [&](std::uint32_t node) {
    return outer(node) ? cache_.resident(node) || cache_.stored(node) : inside_->resident(node);
  });
}

bool Compliance::columns_pay(std::span<const std::uint32_t> nodes) const {
  const auto count =
      std::count_if(nodes.begin(), nodes.end(), [&](std::uint32_t i) { return compressed(i); });
  if (count > 0) // a sum is of one kind
    return count == std::ssize(nodes) &&
           columns::costs::compressed_pay(compressed_->numbers(nodes), source_->entries());
  const columns::ColumnSource* const columns = source_->columns();
  const bool single = columns != nullptr && columns->single();
  const std::size_t max = columns::costs::nodes_worth_a_solve(source_->entries(), rows_, single);
  return nodes.size() <= std::min(max, capacity()) &&
         std::all_of(nodes.begin(), nodes.end(), [&](std::uint32_t node) { return outer(node); }) &&
         stored(nodes);
}

bool Compliance::at_hand(std::span<const std::uint32_t> nodes) const {
  return columns_pay(nodes) &&
         (source_->blocks() == nullptr ||
          std::ranges::all_of(nodes, [&](std::uint32_t node) { return cache_.resident(node); }));
}

bool Compliance::columns_for_shape(std::span<const std::uint32_t> nodes, int shapes) {
  if (source_->blocks() == nullptr)
    return true; // that is where blocks came from
  if (columns::costs::columns_pay_for_shapes(nodes.size(), stored(nodes), shapes))
    need(nodes);
  // Until then their stored columns, which would have to be corrected first, stay where they are.
  return std::all_of(nodes.begin(), nodes.end(),
                     [&](std::uint32_t node) { return cache_.resident(node); });
}

const columns::CompressedColumns*
Compliance::compressed_for(std::span<const std::uint32_t> nodes) const {
  return !nodes.empty() && compressed(nodes.front()) && columns_pay(nodes) ? compressed_ : nullptr;
}

void Compliance::add(std::span<const contact::NodeVector> forces, double allowed,
                     std::span<double> u) {
  if (forces.empty())
    return;
  const std::vector<std::uint32_t> nodes = nodes_of(forces);
  if (const columns::CompressedColumns* const columns = compressed_for(nodes); columns != nullptr) {
    columns->add(forces, context_, u);
    return;
  }
  if (columns_pay(nodes)) {
    need(nodes);
    cache_.add(forces, allowed, context_, u);
    return;
  }
  std::vector<double> f(axes_, 0);
  for (const contact::NodeVector& force : forces)
    for (int a = 0; a < 3; ++a)
      f[axis_of(force.node, a)] = force.value[a];
  solve(f);
  for (std::size_t r = 0; r < u.size(); ++r)
    u[r] += f[r];
}

} // namespace gewebe::compliance
