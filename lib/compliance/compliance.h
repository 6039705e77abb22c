#pragma once
// Compliance C = K⁻¹ of a model as one operator: blocks between a few nodes, rows under a few
// forces, whole shapes. It hides its data (compliance/compliance_source.h) and the choice of the
// cheapest way (columns/costs.h): single entries and sums of a few columns come from memory,
// solutions for loads on many nodes from the factor.
//
// Stored columns may have rows for the first m nodes only (columns/columns.h). Sums of columns then
// have these rows only, and inner nodes cost nothing; solve() gives all rows. Columns of the other
// nodes are solved for, and have all rows.

#include "base/context.h"
#include "columns/column_cache.h"
#include "compliance/compliance_source.h"
#include "contact/load.h"
#include "linalg/condition.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gewebe::compliance {

/// Compliance of one model, with a cache of columns.
class Compliance {
public:
  /// Keeps a reference to the model.
  /// \param source  null: K is factorised
  /// \param bounded  whether add() may be called with `allowed` > 0
  /// \param may_be_free  whether K may be singular; then is_free() holds, and no other member may
  /// be called
  /// \pre check_model(model) passes; the source belongs to the model
  /// \throw Error as ComplianceSource, and if columns of the source have other rows than for the
  /// surface or for all nodes
  Compliance(const model::Model& model, std::shared_ptr<ComplianceSource> source,
             const Context& context, bool bounded, bool may_be_free = false);
  Compliance(const Compliance&) = delete;
  Compliance& operator=(const Compliance&) = delete;

  /// Whether K is singular: the model can move freely unless nodes are displaced.
  bool is_free() const noexcept { return free_.has_value(); }
  /// \throw SingularStiffness if is_free()
  void require_held() const;
  std::size_t axes() const noexcept { return axes_; } ///< 3 n
  std::size_t rows() const noexcept { return rows_; } ///< 3 m, number of rows of sums

  // ---- blocks

  /// Prepares blocks between these nodes; those of other nodes may be forgotten.
  void need_blocks(std::span<const std::uint32_t> nodes);
  /// Block of C between two nodes; 0 where an axis is fixed.
  /// \pre both nodes were among those of the last need_blocks
  ComplianceBlock block(std::uint32_t node, std::uint32_t other) const;
  /// The same from columns, with the bits of `entry`. \pre the node was among those of the last
  /// need
  ComplianceBlock column_block(std::uint32_t node, std::uint32_t other) const;
  /// Whether C f at such nodes needs no solve, because the factor updates the solution of a load.
  bool carries() const noexcept { return source_->blocks() != nullptr; }
  /// C f at some nodes. \pre carries(); the nodes were among those of the last need_blocks
  std::vector<Vec3> carried(std::span<const double> over_axes,
                            std::span<const std::uint32_t> nodes);

  // ---- rows

  /// Brings columns to memory, except compressed ones. \pre they fit
  /// \throw Error if they can't be read
  void need(std::span<const std::uint32_t> nodes);
  /// Solves, ahead of `need`, for columns of the first m nodes that are neither stored nor in
  /// memory. It changes no result. \throw Error if they don't fit
  void prepare(std::span<const std::uint32_t> nodes);
  /// Reads all compressed columns, if there are any. It changes no result.
  /// \throw Error if they can't be read
  void read_compressed() const;
  /// Whether the columns of these nodes fit in memory.
  bool fit(std::span<const std::uint32_t> nodes) const;
  /// Entry of C at a row and a node's axis; 0 where the axis is fixed.
  /// \pre need() was called for the node, and for that of the row if it is none of the first m
  double entry(std::uint32_t node, int axis, std::size_t row) const;
  /// values += C f at these rows, by columns.
  /// \pre columns_pay for the nodes of the forces; rows are below rows(), with one value for each
  void add_rows(std::span<const contact::NodeVector> forces, std::span<const std::size_t> rows,
                std::span<double> values);

  // ---- shapes

  /// u += C f at the first rows() rows, by columns if they pay, else by a solve. Small
  /// contributions are left out of sums of columns, within `allowed`.
  /// \param forces  ascending, of different nodes
  /// \param allowed  largest error of an entry, mm
  void add(std::span<const contact::NodeVector> forces, double allowed, std::span<double> u);

  /// Compressed columns, if all of the first m nodes that can move have one: parts of sums can be
  /// computed; else null.
  const columns::CompressedColumns* compressed_rows() const noexcept { return whole_; }

  /// u = C f in place, for right-hand sides over all axes, one after the other.
  void solve(std::span<double> over_axes, std::size_t columns = 1);

  /// Bound of the error of an entry of C f by compression of stored columns, mm; 0 for other
  /// columns. `relative` is the requested bound.
  columns::EntryBound bound(std::span<const contact::NodeVector> forces) const;

  // ---- costs

  /// Whether the columns of all these nodes are stored or in memory.
  bool stored(std::span<const std::uint32_t> nodes) const;
  /// Whether the sum of columns under forces at these nodes is cheaper than a solve. It does not
  /// depend on the number of threads, because the bits of the result depend on it.
  bool columns_pay(std::span<const std::uint32_t> nodes) const;
  /// Whether a sum of columns under forces at these nodes pays and does not change later choices.
  bool at_hand(std::span<const std::uint32_t> nodes) const;
  /// Whether the columns of nodes whose blocks were needed are available for the shape under forces
  /// there. Columns are brought to memory if that pays.
  /// \param shapes  number of shapes with these nodes, this one included
  bool columns_for_shape(std::span<const std::uint32_t> nodes, int shapes);

  /// What choices depend on: columns in memory, work that is done once. Copies share it.
  struct Past {
    columns::ColumnCache::Past outer{};
    std::optional<columns::ColumnCache::Past> inside{};
    bool warm = false;
  };
  Past past() const;
  void restore(const Past& past);

  std::uint64_t solves() const noexcept { return solves_; }
  std::uint64_t factors() const { return source_->factors(); } ///< factors computed or loaded
  const columns::ColumnCache& cache() const noexcept { return cache_; }

private:
  /// Compressed columns, if a sum with forces at these nodes needs no others; else null.
  const columns::CompressedColumns* compressed_for(std::span<const std::uint32_t> nodes) const;
  bool compressed(std::uint32_t node) const;
  std::size_t capacity() const noexcept; ///< nodes whose columns fit in memory, of the first m
  bool outer(std::uint32_t node) const noexcept { return 3 * std::size_t{node} < rows_; }
  columns::ColumnSolve columns_of(std::size_t rows);

  std::size_t axes_;
  std::shared_ptr<ComplianceSource> source_;
  const columns::CompressedColumns* compressed_; ///< of the source, or null
  const columns::CompressedColumns* whole_;      ///< see compressed_rows
  std::size_t rows_;
  Context context_;
  columns::ColumnCache cache_;
  std::optional<columns::ColumnCache> inside_; ///< of the nodes after the first m, if there are any
  std::uint64_t solves_ = 0;
  std::optional<linalg::SingularStiffness> free_;
};

} // namespace gewebe::compliance
