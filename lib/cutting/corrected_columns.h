#pragma once
// Columns of the compliance of a cut model from those of the model before: each costs a few sparse
// products and one pass over the responses to the cut, instead of a solve.

#include "base/columns.h"
#include "base/context.h"
#include "cutting/stiffness_change.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe {

class CorrectedColumns final : public ColumnSource {
public:
  /// Takes no time: the responses are solved for when a column is first read, with `solve` of the
  /// later K' (rank() solves). Nodes that had columns and are still there have them, and their
  /// copies too.
  ///
  /// \param before columns of the earlier model, which this one keeps
  /// \param solve_before of the earlier K, or null; where it is given, what the cut answers is
  /// found by rank() solves of that instead of from the columns, so that columns of float32 are no
  /// less exact than they were
  /// \param solve_entries doubles that `solve` reads twice for a right-hand side; 0: reading always
  /// pays
  /// \throw Error if the columns are of another number of nodes
  CorrectedColumns(std::shared_ptr<const ColumnSource> before, StiffnessChange change,
                   AxesSolve solve, const Context& context, AxesSolve solve_before = {},
                   std::size_t solve_entries = 0);

  std::size_t node_count() const override { return change_.origin.size(); }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }
  /// Not from several threads at once. \throw Error what the columns before and the solves throw
  void read(std::size_t k, std::span<double> out) const override;
  bool single() const override { return before_->single(); }
  /// By the operations that each way takes, the responses counted while they are not there.
  bool pays(std::size_t count) const override;
  void read_single(std::size_t k, std::span<float> out) const override;
  /// Of the columns before, and what correcting makes of it. Solves where nothing was read yet.
  EntryBound bound() const override;

  /// As read, of nodes first to first + count - 1, one behind the other: faster than one by one,
  /// with the same bytes. \pre out.size() == 9 n count
  void read(std::size_t first, std::size_t count, std::span<double> out) const;

  const StiffnessChange& change() const noexcept { return change_; }
  /// Bound of what an error in an entry of a column before becomes in the corrected one, in
  /// multiples of it, at most; 1 where solve_before is given. Solves where nothing was read yet.
  double error_gain() const;

private:
  void prepare() const;

  std::shared_ptr<const ColumnSource> before_;
  StiffnessChange change_;
  AxesSolve solve_, solve_before_;
  std::size_t solve_entries_ = 0;
  Context context_;
  std::vector<std::uint32_t> nodes_;
  std::vector<std::size_t> stored_; ///< by nodes_: its place in before_->nodes()
  mutable bool prepared_ = false;
  mutable std::vector<double> response_; ///< C' W, packed as ResponseSum takes it
  mutable std::vector<double> answers_;  ///< C Q, [rank][3 n], where solve_before is given
};

} // namespace gewebe
