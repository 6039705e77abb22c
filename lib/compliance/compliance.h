#pragma once
// The compliance C = K⁻¹ of a model as one operator: blocks of it between a few nodes, rows under
// forces at a few, whole shapes. What it is backed by (compliance/compliance_source.h), and what is
// cheapest for what is asked (compliance/costs.h), stays behind it: single entries and sums of a
// few columns come from memory, answers to loads on many nodes from the factor.
//
// Where stored columns have rows for the first m nodes alone (base/columns.h), sums are of these
// rows, and what is inside costs nothing; only solve() gives all. Columns of the other nodes are
// solved for, and have all rows.

#include "base/context.h"
#include "compliance/column_cache.h"
#include "compliance/compliance_source.h"
#include "contact/load.h"
#include "model/model.h"
#include "solve/condition.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe {

class Compliance {
public:
  /// Keeps a reference to the model. \param source null: K is factorised \param bounded whether add
  /// may be asked to leave something out \param may_be_free whether K may be singular: then
  /// is_free() holds, and nothing may be asked for
  /// \pre check_model(model) passes; the source belongs to it   \throw Error as ComplianceSource,
  /// and if columns of the source have other rows than for the surface or for all nodes
  Compliance(const Model& model, std::shared_ptr<ComplianceSource> source, const Context& context,
             bool bounded, bool may_be_free = false);
  Compliance(const Compliance&) = delete;
  Compliance& operator=(const Compliance&) = delete;

  /// K is singular: the model can move freely unless nodes are displaced.
  bool is_free() const noexcept { return free_.has_value(); }
  /// \throw SingularStiffness if is_free()
  void require_held() const;
  std::size_t axes() const noexcept { return axes_; } ///< 3 n
  std::size_t rows() const noexcept { return rows_; } ///< 3 m, which sums have

  // ---- blocks

  /// Prepares blocks between these nodes; those of other nodes may be forgotten.
  void need_blocks(std::span<const std::uint32_t> nodes);
  /// \pre both nodes were among those of the last need_blocks; 0 where an axis is fixed
  ComplianceBlock block(std::uint32_t node, std::uint32_t other) const;
  /// The same of columns, bit by bit as `entry`. \pre the node was among those of the last need
  ComplianceBlock column_block(std::uint32_t node, std::uint32_t other) const;
  /// Whether C f at such nodes costs no solve, for the factor carries a load along.
  bool carries() const noexcept { return source_->blocks() != nullptr; }
  /// C f there. \pre carries(); the nodes were among those of the last need_blocks
  std::vector<Vec3> carried(std::span<const double> over_axes,
                            std::span<const std::uint32_t> nodes);

  // ---- rows

  /// Brings columns to memory, but for compressed ones. \pre they fit
  /// \throw Error if they can't be read
  void need(std::span<const std::uint32_t> nodes);
  /// Solves for those that are neither stored nor in memory, of the first m nodes, ahead of `need`:
  /// nothing else depends on it. \throw Error if they don't fit
  void prepare(std::span<const std::uint32_t> nodes);
  /// Reads compressed columns whole, if that is what there is: nothing else depends on it.
  /// \throw Error if they can't be read
  void read_compressed() const;
  /// Whether the columns of these nodes fit in memory.
  bool fit(std::span<const std::uint32_t> nodes) const;
  /// C at a row and a node's axis. \pre the node was needed, and that of the row too if it is none
  /// of the first m; 0 where the axis is fixed
  double entry(std::uint32_t node, int axis, std::size_t row) const;
  /// values += C f at these rows, by columns. \pre columns_pay for the nodes of the forces; one
  /// value for each row, which are below rows()
  void add_rows(std::span<const NodeVector> forces, std::span<const std::size_t> rows,
                std::span<double> values);

  // ---- shapes

  /// u += C f at the first rows() rows by columns, where they pay, or by a solve. Contributions
  /// that the tolerance allows are left out of sums of columns. \param forces ascending, of
  /// different nodes \param allowed mm, by which an entry may be wrong
  void add(std::span<const NodeVector> forces, double allowed, std::span<double> u);

  /// u = C f in place, for right-hand sides over all axes one behind the other.
  void solve(std::span<double> over_axes, std::size_t columns = 1);

  /// By how much an entry of C f may be wrong because stored columns are compressed, mm; 0 for
  /// others. `relative` is what they were asked for.
  EntryBound bound(std::span<const NodeVector> forces) const;

  // ---- what pays

  /// Whether all these have columns that are stored or in memory.
  bool stored(std::span<const std::uint32_t> nodes) const;
  /// Whether the sum of columns under forces at these nodes is cheaper than a solve. Does not
  /// depend on the number of threads, for the bits of the result do.
  bool columns_pay(std::span<const std::uint32_t> nodes) const;
  /// Whether a sum of columns under forces at these nodes pays and has no effect on what pays
  /// later.
  bool at_hand(std::span<const std::uint32_t> nodes) const;
  /// Whether the columns of nodes whose blocks were needed are at hand for the shape under forces
  /// there; they are brought where that pays. \param shapes how many were asked for with these
  /// nodes, this one among them
  bool columns_for_shape(std::span<const std::uint32_t> nodes, int shapes);

  std::uint64_t solves() const noexcept { return solves_; }
  std::uint64_t factors() const { return source_->factors(); } ///< factorised or loaded
  const ColumnCache& cache() const noexcept { return cache_; }

private:
  /// Of which alone a sum with forces at these nodes would be; null: not of compressed ones.
  const CompressedColumns* compressed_for(std::span<const std::uint32_t> nodes) const;
  bool compressed(std::uint32_t node) const;
  std::size_t capacity() const noexcept; ///< nodes whose columns fit in memory, of the first m
  bool outer(std::uint32_t node) const noexcept { return 3 * std::size_t{node} < rows_; }
  ColumnSolve columns_of(std::size_t rows);

  std::size_t axes_;
  std::shared_ptr<ComplianceSource> source_;
  const CompressedColumns* compressed_; ///< of the source, or null
  std::size_t rows_;
  Context context_;
  ColumnCache cache_;
  std::optional<ColumnCache> inside_; ///< of the nodes behind the first m, if there are any
  std::uint64_t solves_ = 0;
  std::optional<SingularStiffness> free_;
};

} // namespace gewebe
