#include "compliance/compliance.h"

#include "base/vector_at.h"
#include "compliance/costs.h"
#include "compliance/forward_blocks.h"

#include <algorithm>
#include <utility>

namespace gewebe {

namespace {

constexpr double max_column_bytes = 1073741824; // where memory is not bounded

std::vector<std::uint32_t> nodes_of(std::span<const NodeVector> forces) {
  std::vector<std::uint32_t> nodes;
  nodes.reserve(forces.size());
  for (const NodeVector& f : forces)
    nodes.push_back(f.node);
  return nodes;
}

} // namespace

Compliance::Compliance(const Model& model, std::shared_ptr<ComplianceSource> source,
                       const Context& context, bool bounded)
    : axes_(3 * model.nodes.size()), source_(source ? std::move(source) : compliance_of_model()),
      context_(context),
      cache_(
          model.nodes.size(), source_->columns(),
          [this](std::span<const std::uint32_t> nodes, std::span<double> columns) {
            std::fill(columns.begin(), columns.end(), 0.0);
            for (std::size_t k = 0; k < nodes.size(); ++k)
              for (std::size_t a = 0; a < 3; ++a)
                columns[(3 * k + a) * axes_ + 3 * std::size_t{nodes[k]} + a] = 1;
            solve(columns, 3 * nodes.size());
          },
          std::min(static_cast<double>(context.max_memory) / 4, max_column_bytes), bounded) {
  context_.progress = nullptr;
  source_->open(model, context_);
}

void Compliance::solve(std::span<double> over_axes, std::size_t columns) {
  source_->solve(over_axes, columns);
  solves_ += columns;
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
  ComplianceBlock block{};
  for (int a = 0; a < 3; ++a)
    for (std::size_t b = 0; b < 3; ++b)
      block[static_cast<std::size_t>(a)][b] = entry(node, a, 3 * std::size_t{other} + b);
  return block;
}

void Compliance::add_rows(std::span<const NodeVector> forces, std::span<const std::size_t> rows,
                          std::span<double> values) {
  need(nodes_of(forces));
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (const NodeVector& f : forces)
      for (int a = 0; a < 3; ++a)
        values[k] += entry(f.node, a, rows[k]) * f.value[a];
}

bool Compliance::stored(std::span<const std::uint32_t> nodes) const {
  return std::all_of(nodes.begin(), nodes.end(), [&](std::uint32_t node) {
    return cache_.resident(node) || cache_.stored(node);
  });
}

bool Compliance::columns_pay(std::span<const std::uint32_t> nodes) const {
  const ColumnSource* const columns = source_->columns();
  const bool single = columns != nullptr && columns->single();
  const std::size_t max = costs::nodes_worth_a_solve(source_->entries(), axes_, single);
  return nodes.size() <= std::min(max, capacity()) && stored(nodes);
}

bool Compliance::columns_for_shape(std::span<const std::uint32_t> nodes, int shapes) {
  if (source_->blocks() == nullptr)
    return true; // that is where blocks came from
  if (costs::columns_pay_for_shapes(nodes.size(), stored(nodes), shapes))
    need(nodes);
  // Until then their stored columns, which would have to be corrected first, stay where they are.
  return std::all_of(nodes.begin(), nodes.end(),
                     [&](std::uint32_t node) { return cache_.resident(node); });
}

void Compliance::add(std::span<const NodeVector> forces, double allowed, std::span<double> u) {
  if (forces.empty())
    return;
  const std::vector<std::uint32_t> nodes = nodes_of(forces);
  if (columns_pay(nodes)) {
    need(nodes);
    cache_.add(forces, allowed, context_, u);
    return;
  }
  std::vector<double> f(axes_, 0);
  for (const NodeVector& force : forces)
    for (int a = 0; a < 3; ++a)
      f[axis_of(force.node, a)] = force.value[a];
  solve(f);
  for (std::size_t r = 0; r < u.size(); ++r)
    u[r] += f[r];
}

} // namespace gewebe
