#pragma once
// Columns of a compliance that stay in memory, as a store would give them, for the benchmarks.

#include "columns/columns.h"
#include "columns/compliance_columns.h"
#include "compliance/compliance_source.h"
#include "linalg/condition.h"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

namespace gewebe::timing {

class MemoryColumns final : public columns::ColumnSource, public columns::ColumnSink {
public:
  /// With rows for the first `rows` of `count` nodes.
  MemoryColumns(std::size_t count, std::vector<std::uint32_t> nodes, bool single, std::size_t rows)
      : count_(count), rows_(rows), nodes_(std::move(nodes)), single_(single) {}
  void write(std::size_t, std::span<const double> columns, double) override {
    columns_.emplace_back(columns.begin(), columns.end());
  }
  std::size_t node_count() const override { return count_; }
  std::size_t row_nodes() const override { return rows_; }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }
  void read(std::size_t k, std::span<double> out) const override {
    std::copy(columns_[k].begin(), columns_[k].end(), out.begin());
  }
  bool single() const override { return single_; }

private:
  std::size_t count_, rows_;
  std::vector<std::uint32_t> nodes_;
  bool single_;
  std::vector<std::vector<double>> columns_;
};

/// Factor and columns of these nodes (ascending), as float32 where `single`, with rows for the
/// first `row_nodes` nodes, or for all if there are fewer.
inline compliance::StoredStiffness memory_stiffness(const linalg::StiffnessMatrix& matrix,
                                                    const linalg::FactorData& data,
                                                    const std::vector<std::uint32_t>& nodes,
                                                    bool single, std::size_t row_nodes = SIZE_MAX) {
  const std::size_t count = matrix.row_of_axis.size() / 3, rows = std::min(row_nodes, count);
  auto columns = std::make_unique<MemoryColumns>(count, nodes, single, rows);
  (void)columns::compliance_columns(matrix, linalg::Factor(data), linalg::stiffness_norm(matrix),
                                    nodes, {}, *columns, rows);
  return {std::move(columns), [&data] { return linalg::Factor(data); }};
}

} // namespace gewebe::timing
