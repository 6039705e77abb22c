#pragma once
// Factor of K with vectors over all 3 n axes of a model, held axes included.

#include "base/context.h"
#include "linalg/factor.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::compliance {

struct AxisSolver {
  linalg::Factor factor;
  std::vector<std::int64_t> row_of_axis; ///< 3 n: row, or -1 where the axis is held

  /// Solves for `columns` right-hand sides, one behind the other, in place: 0 on held axes.
  void solve(std::span<double> over_axes, std::size_t columns = 1) const;
};

/// Factorises K, and checks its condition. \throw Error as checked_factor
AxisSolver factorise_axes(const model::Model& model, const Context& context);

/// Factorises K with further axes held (3 n flags), which can only improve its condition.
/// \pre some axis is free   \throw Error as the factor
AxisSolver factorise_axes(const model::Model& model, std::span<const std::uint8_t> held,
                          const Context& context);

/// Solver with a precomputed factor of K.
/// \throw Error if the number of its rows is not that of the model's free axes
AxisSolver stored_axes(const model::Model& model, linalg::Factor factor);

} // namespace gewebe::compliance
