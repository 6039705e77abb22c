#pragma once
// The compliance C = K⁻¹ of a model, by whatever is cheapest for what is asked: single entries and
// sums of a few columns from memory, the sparse factor for loads on many nodes.

#include "base/columns.h"
#include "base/context.h"
#include "compliance/axis_solver.h"
#include "compliance/column_cache.h"
#include "contact/load.h"
#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

/// C at the axes of a node and of another, [axis][axis of the other].
using ComplianceBlock = std::array<std::array<double, 3>, 3>;

/// Blocks of C between some nodes, for less than their columns cost.
class BlockSource {
public:
  virtual ~BlockSource() = default;
  /// Prepares blocks between these nodes and all that were needed before; those may be forgotten.
  virtual void need(std::span<const std::uint32_t> nodes) = 0;
  /// \pre both nodes were among the last ones needed
  virtual ComplianceBlock block(std::uint32_t node, std::uint32_t other) const = 0;
};

/// What was computed beforehand. The factor is asked for once, when first needed; without it, and
/// without another solver, K is factorised by the constructor. Columns may be absent or of some
/// nodes.
struct StiffnessParts {
  std::function<Factor()> factor;
  std::unique_ptr<ColumnSource> columns;
  /// In place of the factor: solves over all axes, in place, as AxisSolver::solve; and what that
  /// reads, in doubles.
  std::function<void(std::span<double> over_axes, std::size_t columns)> solve{};
  std::size_t solve_entries = 0;
  std::shared_ptr<BlockSource> blocks{}; ///< in place of columns, where only blocks are asked for
};

class Compliance {
public:
  /// Keeps a reference to the model. \param bounded whether add may be asked to leave something out
  /// \pre check_model(model) passes; parts belong to it
  /// \throw Error as factorise_axes, where no factor is given
  Compliance(const Model& model, StiffnessParts parts, const Context& context, bool bounded);
  Compliance(const Compliance&) = delete;
  Compliance& operator=(const Compliance&) = delete;

  const Model& model() const noexcept { return model_; }
  std::size_t axes() const noexcept { return 3 * model_.nodes.size(); }

  /// Whether all these have columns that are stored or in memory.
  bool stored(std::span<const std::uint32_t> nodes) const;
  /// How many nodes' columns fit in memory.
  std::size_t capacity() const noexcept { return cache_->capacity(); }
  /// Brings columns to memory. \pre at most capacity() nodes \throw Error if they can't be read
  void need(std::span<const std::uint32_t> nodes) { cache_->need(nodes); }
  /// As need, but of C only blocks between these nodes will be asked for.
  void need_blocks(std::span<const std::uint32_t> nodes);
  /// \pre both nodes were among those of the last need_blocks; 0 where an axis is fixed
  ComplianceBlock block(std::uint32_t node, std::uint32_t other) const;
  /// Whether blocks come without columns, which then are not at hand for sums.
  bool has_blocks() const noexcept { return parts_.blocks != nullptr; }
  /// C at a row and a node's axis. \pre the node was needed; 0 where the axis is fixed
  double entry(std::uint32_t node, int axis, std::size_t row) const {
    return cache_->entry(node, axis, row);
  }

  /// Whether the sum of columns under forces at these nodes is cheaper than a solve. Does not
  /// depend on the number of threads, for the bits of the result do.
  bool columns_pay(std::span<const std::uint32_t> nodes) const;
  /// u += C f by columns, where they pay, or by a solve. Contributions that the tolerance allows
  /// are left out of sums of columns. \param forces ascending, of different nodes \param allowed
  /// mm, by which an entry may be wrong
  void add(std::span<const NodeVector> forces, double allowed, std::span<double> u);
  /// In place, for right-hand sides over all axes one behind the other.
  void solve(std::span<double> over_axes, std::size_t columns = 1);

  std::uint64_t solves() const noexcept { return solves_; }
  std::uint64_t factors() const noexcept { return factors_; } ///< factorised or loaded
  const ColumnCache& cache() const noexcept { return *cache_; }

private:
  const AxisSolver& whole();
  std::size_t entries() const;
  const Model& model_;
  StiffnessParts parts_;
  Context context_;
  std::optional<AxisSolver> solver_;
  std::optional<ColumnCache> cache_;
  std::uint64_t solves_ = 0, factors_ = 0;
};

} // namespace gewebe
