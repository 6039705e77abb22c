#pragma once
// The sparse Cholesky factor of a stiffness matrix, K = Pᵀ L Lᵀ P: a compliance for any load. The
// order of elimination is a library's (cholesky/ordering.h), the numbers are those of our own
// fronts (cholesky/multifrontal.h): the same bytes on any processor and any number of threads.

#include "base/context.h"
#include "base/error.h"
#include "linalg/stiffness.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::linalg {

/// A supernodal factor as plain arrays, named as in cholmod_factor (lower, int64, 0-based), so that
/// it can be stored. A supernode is what a front eliminates.
struct FactorData {
  std::int64_t order = 0;
  std::int64_t max_column_size = 0, max_row_size = 0; ///< maxcsize (most entries of an
                                                      ///< update matrix), maxesize (of its rows)
  std::vector<std::int64_t> permutation;              ///< Perm, order
  std::vector<std::int64_t> column_count;             ///< ColCount, order
  std::vector<std::int64_t> super;                    ///< nsuper + 1
  std::vector<std::int64_t> pi, px;                   ///< nsuper + 1
  std::vector<std::int64_t> s;                        ///< row indices
  std::vector<double> x;                              ///< values
};

/// The same arrays where they are.
struct FactorView {
  std::int64_t order = 0;
  std::int64_t max_column_size = 0, max_row_size = 0;
  std::span<const std::int64_t> permutation, column_count, super, pi, px, s;
  std::span<const double> x;
};

/// Thrown where a pivot isn't positive. By itself this decides nothing: linalg/condition.h finds
/// out what it means.
class NotPositiveDefinite : public Error {
public:
  explicit NotPositiveDefinite(std::size_t row);
  /// Of K, where the factorisation stopped.
  std::size_t row() const noexcept { return row_; }

private:
  std::size_t row_;
};

class Factor {
public:
  /// Of any symmetric matrix; rows whose axes belong to one node are eliminated together.
  /// \throw NotPositiveDefinite by its pivots alone; Error if memory exceeds the context's;
  /// Cancelled
  Factor(const StiffnessMatrix& matrix, const Context& context);
  /// The factor of another matrix of the same pattern: what depends on the pattern alone is kept.
  /// \pre made by the constructor above   \throw as it; then the factor is of no use
  void refactor(const StiffnessMatrix& matrix, const Context& context);
  /// \throw Error if the arrays contradict each other (every index is checked: they come from
  /// files)
  explicit Factor(FactorData data, CpuLevel cpu = best_cpu_level());
  ~Factor();
  Factor(Factor&&) noexcept;
  Factor& operator=(Factor&&) noexcept;

  std::size_t order() const noexcept;
  /// Copies, and the arrays themselves, valid as long as the factor lives.
  FactorData data() const;
  FactorView view() const noexcept;
  /// Doubles in L, zeros of the supernodes counted.
  std::size_t entries() const noexcept;

  /// u = K⁻¹ f for `columns` right-hand sides, each of order() numbers one behind the other. Safe
  /// from many threads at once. The same bytes whatever the other threads do, for each right-hand
  /// side whatever the others are, and on every machine that has the same factor.
  /// \pre f.size() == u.size() == order() * columns
  void solve(std::span<const double> f, std::span<double> u, std::size_t columns = 1) const;

  /// Most columns that solve_units takes at once.
  static constexpr std::size_t max_units = 24;
  /// Columns of K⁻¹ side by side, without the copies that `solve` makes: x[k][c] is the entry of
  /// row permutation[k] in column permutation[places[c]], with the permutation of view(). Returns
  /// how many numbers lie between one k and the next, places.size() rounded up. Otherwise as
  /// `solve`, with the same bits. \pre at most max_units places
  std::size_t solve_units(std::span<const std::int64_t> places, std::vector<double>& x) const;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Columns of C over all 3 n axes, one behind the other: responses to a force of 1 along each of
/// these axes, 0 for fixed ones. \pre u.size() == axes.size() * matrix.row_of_axis.size()
void solve_unit_axes(const StiffnessMatrix& matrix, const Factor& factor,
                     std::span<const std::size_t> axes, std::span<double> u);

/// u = C f over all 3 n axes: forces on fixed axes are ignored, displacements there are 0.
/// \pre f.size() == u.size() == matrix.row_of_axis.size(), the factor is of this matrix
void solve_axes(const StiffnessMatrix& matrix, const Factor& factor, std::span<const double> f,
                std::span<double> u);

} // namespace gewebe::linalg
