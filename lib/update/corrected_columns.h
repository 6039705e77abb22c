#pragma once
// Columns of the compliance of a cut model by correction of those of the model before. Each costs a
// few sparse products and one pass over the responses to the cut, instead of a solve.

#include "base/context.h"
#include "columns/columns.h"
#include "update/stiffness_change.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::update {

class CorrectedColumns final : public columns::ColumnSource {
public:
  /// Does no work: the responses are solved for when a column is first read, with `solve` of the
  /// later K' (rank() solves). Remaining nodes that had columns have them, and so have their
  /// copies.
  ///
  /// \param before  columns of the earlier model; kept
  /// \param solve_before  of the earlier K, or empty. If given, rank() solves of it give C Q,
  /// instead of the columns, so that columns of float32 lose no precision
  /// \param solve_entries  doubles that `solve` reads twice for a right-hand side; 0: reading
  /// always
  /// pays
  /// \throw Error if the columns are of another number of nodes
  CorrectedColumns(std::shared_ptr<const columns::ColumnSource> before, StiffnessChange change,
                   AxesSolve solve, const Context& context, AxesSolve solve_before = {},
                   std::size_t solve_entries = 0);

  std::size_t node_count() const override { return change_.origin.size(); }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }
  /// Not from several threads at once. \throw Error what the columns before and the solves throw
  void read(std::size_t k, std::span<double> out) const override;
  bool single() const override { return before_->single(); }
  /// Compares operations of both ways. Those of the responses count until the responses are known.
  bool pays(std::size_t count) const override;
  void read_single(std::size_t k, std::span<float> out) const override;
  /// Bound of the earlier columns, times error_gain(). Solves if nothing was read yet.
  columns::EntryBound bound() const override;

  /// As read, for nodes first to first + count - 1, node by node: faster than one by one,
  /// with the same bytes. \pre out.size() == 9 n count
  void read(std::size_t first, std::size_t count, std::span<double> out) const;

  /// Whether the responses count as known, see ComplianceSource::is_warm.
  bool is_warm() const noexcept { return warm_; }
  void set_warm(bool warm) noexcept { warm_ = warm; }
  const StiffnessChange& change() const noexcept { return change_; }
  /// Largest factor by which the correction amplifies an error in an entry of an earlier column; 1
  /// if solve_before is given. Solves if nothing was read yet.
  double error_gain() const;

private:
  void prepare() const;

  std::shared_ptr<const columns::ColumnSource> before_;
  StiffnessChange change_;
  AxesSolve solve_, solve_before_;
  std::size_t solve_entries_ = 0;
  Context context_;
  std::vector<std::uint32_t> nodes_;
  std::vector<std::size_t> stored_; ///< by nodes_: its place in before_->nodes()
  mutable bool prepared_ = false, warm_ = false;
  mutable std::vector<double> response_; ///< C' W, packed as ResponseSum takes it
  mutable std::vector<double> answers_;  ///< C Q, [rank][3 n], if solve_before is given
};

} // namespace gewebe::update
