#pragma once
// The elastostatic method (fast finite elements; Bro-Nielsen 1998, report 3.3.2, 3.3.3): the shape
// follows the load at once, u = C f with C = K⁻¹ of the model linearised at rest.
//
// Prescribed displacements d of m nodes, few: the block C_cc on their free axes gives the forces
// f_c = C_cc⁻¹ (d - u_c of all other loads). Many: K with these axes held, K_ff u_f = f - K_fc d,
// f_c = K_cf u_f + K_cc d. Both are exact; which is cheaper decides. Displaced nodes then stand at
// exactly d.

#include "base/columns.h"
#include "base/context.h"
#include "model/model.h"
#include "sim/factor.h"
#include "sim/load.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace gewebe {

/// What was computed beforehand. The factor is asked for once, when first needed; without it K is
/// factorised by the constructor. Columns may be absent or of some nodes.
struct StiffnessParts {
  std::function<Factor()> factor;
  std::unique_ptr<ColumnSource> columns;
};

/// How an elastostatic object came to its shapes.
struct ElastostaticCounts {
  std::uint64_t updates = 0, unchanged = 0; ///< asked for; answered without work
  std::uint64_t solves = 0;                 ///< right-hand sides solved with a factor
  std::uint64_t columns_read = 0;           ///< nodes whose columns were read
  std::uint64_t factors = 0;                ///< factorised or loaded
  double backward_error = 0; ///< largest ‖Ku - f‖ / (‖K‖‖u‖ + ‖f‖) seen, where it was asked for
  double contact_error = 0; ///< largest miss of a prescribed displacement, over the largest one
};

struct ElastostaticOptions {
  bool measure_error = false; ///< the backward error of every new shape
  /// Displaced nodes up to which the block C_cc is used; by default what is cheaper.
  std::size_t block_limit = SIZE_MAX;
};

class Elastostatic {
public:
  /// Keeps a reference to the model. \pre check_model(model) passes; parts belong to it
  /// \throw Error as the factor: K singular, memory
  Elastostatic(const Model& model, StiffnessParts parts, const Context& context,
               const ElastostaticOptions& options = {});
  ~Elastostatic();
  Elastostatic(Elastostatic&&) noexcept;

  /// The shape under `load`; nothing is done if it is the last one. Only what changed is computed
  /// again. \pre nodes exist, no displacement along an axis that the model holds
  /// \throw Error if columns can't be read, memory does not suffice, the shape is not finite, or
  /// displacements are not met within 1e-6 of the largest
  void update(const Load& load);

  /// 3 n numbers, mm; exactly the prescribed ones at displaced nodes.
  std::span<const double> displacement() const noexcept;

  /// What holds the displaced nodes, as Elastodynamic::contact_forces.
  const std::vector<NodeVector>& contact_forces() const noexcept;

  const ElastostaticCounts& counts() const noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// How far a shape is from where linear elasticity holds: over all edge springs the largest change
/// of length over length, and the largest turn (displacement of one end against the other, across
/// the edge, over its length).
struct LinearRange {
  double strain = 0, turn = 0;
  std::size_t strain_spring = 0, turn_spring = 0; ///< where: indices of springs
};
LinearRange linear_range(const Model& model, std::span<const double> displacement);

} // namespace gewebe
