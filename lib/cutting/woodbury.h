#pragma once
// A cut model solved with the factor of the model before.

#include "base/context.h"
#include "cutting/stiffness_change.h"

#include <cstddef>
#include <memory>
#include <span>

namespace gewebe {

/// u' = C' f' from a solver of the earlier K, by the capacitance matrix of the change (Sherman and
/// Morrison 1950; Woodbury 1950; Hager 1989, in the symmetric form of a bordered system).
///
/// With u' = E a + J d, d what the copies move beside their origins, p the forces of the severed
/// springs, V Σ Vᵀ their change, B = Jᵀ K' E and H = Jᵀ K' J the copies' rows:
///
///   ( K    V    Bᵀ ) (a)   (Eᵀ f')
///   ( Vᵀ  -Σ⁻¹  0  ) (p) = (  0  )                                                            (1)
///   ( B    0    H  ) (d)   (Jᵀ f')
///
/// of which the solver takes K, and a pivoted LU the rank() rows of what is left:
/// S = diag(-Σ⁻¹, H) - Qᵀ C Q.
class WoodburySolver {
public:
  /// Costs rank() solves of K and an LU of that order.
  /// \param solve of the earlier K; called from several threads unless context.threads is 1
  /// \throw Error if the change leaves a part that nothing holds, or gone nodes, so that S is
  /// singular beyond rounding or meaningless; if memory exceeds the context's; Cancelled
  WoodburySolver(StiffnessChange change, AxesSolve solve, const Context& context);
  ~WoodburySolver();
  WoodburySolver(WoodburySolver&&) noexcept;
  WoodburySolver& operator=(WoodburySolver&&) noexcept;

  /// As an AxesSolve of K': one solve of K and 2 · 3 n rank() multiplications for each column. Safe
  /// from many threads where the solver is.
  void solve(std::span<double> over_axes, std::size_t columns = 1) const;

  const StiffnessChange& change() const noexcept;
  /// Estimate of the condition of S, rows and columns scaled: solutions lose so many times the
  /// precision of `solve`.
  double condition() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe
