#pragma once
// A factor that takes and gives vectors over all 3 n axes of a model.

#include "base/context.h"
#include "model/model.h"
#include "solve/factor.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

struct AxisSolver {
  Factor factor;
  std::vector<std::int64_t> row_of_axis; ///< 3 n: row, or -1 where the axis is held

  /// Solves for `columns` right-hand sides, one behind the other, in place: 0 on held axes.
  void solve(std::span<double> over_axes, std::size_t columns = 1) const;
};

/// Of K, which is checked for what it determines. \throw Error as checked_factor
AxisSolver factorise_axes(const Model& model, const Context& context);

/// Of K with further axes held (3 n flags), which can only make it better determined. \pre some
/// axis is free   \throw Error as the factor
AxisSolver factorise_axes(const Model& model, std::span<const std::uint8_t> held,
                          const Context& context);

/// With a factor of K that was made before. \throw Error if it has other rows than the model free
/// axes
AxisSolver stored_axes(const Model& model, Factor factor);

} // namespace gewebe
