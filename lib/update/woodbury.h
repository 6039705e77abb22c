#pragma once
// Solver for a cut model with the factor of the model before the cut.

#include "base/context.h"
#include "update/stiffness_change.h"

#include <cstddef>
#include <memory>
#include <span>

namespace gewebe::update {

/// u' = C' f' from a solver of the earlier K, by the capacitance matrix of the change (Sherman and
/// Morrison 1950; Woodbury 1950; Hager 1989, in the symmetric form of a bordered system).
///
/// With u' = E a + J d, d the displacements of the copies relative to their origins, p the forces
/// of the severed springs, V Σ Vᵀ their change, B = Jᵀ K' E and H = Jᵀ K' J the copies' rows:
///
///   ( K    V    Bᵀ ) (a)   (Eᵀ f')
///   ( Vᵀ  -Σ⁻¹  0  ) (p) = (  0  )                                                            (1)
///   ( B    0    H  ) (d)   (Jᵀ f')
///
/// The solver of K eliminates the first block row. A pivoted LU solves the remaining rank() rows:
/// S = diag(-Σ⁻¹, H) - Qᵀ C Q.
class WoodburySolver {
public:
  /// Costs rank() solves of K and an LU of that order.
  /// \param solve  of the earlier K; called from several threads unless context.threads is 1
  /// \throw Error if nothing holds a part of the model (S is then singular to rounding), if the
  /// change has gone nodes, or if memory exceeds the context's; Cancelled
  WoodburySolver(StiffnessChange change, AxesSolve solve, const Context& context);
  ~WoodburySolver();
  WoodburySolver(WoodburySolver&&) noexcept;
  WoodburySolver& operator=(WoodburySolver&&) noexcept;

  /// Solves for K' as an AxesSolve: one solve of K and 2 · 3 n rank() multiplications for each
  /// column. It is safe from many threads if `solve` of the constructor is.
  void solve(std::span<double> over_axes, std::size_t columns = 1) const;

  const StiffnessChange& change() const noexcept;
  /// Estimate of the condition of S with scaled rows and columns: the factor by which solutions
  /// lose the precision of `solve`.
  double condition() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::update
