#pragma once
// Whether a shape is where linear elasticity may be trusted.

#include "model/model.h"

#include <cstddef>
#include <span>

namespace gewebe {

/// How far a shape is from where linear elasticity holds: over all edge springs the largest change
/// of length over length, and the largest turn (displacement of one end against the other, across
/// the edge, over its length).
struct LinearRange {
  double strain = 0, turn = 0;
  std::size_t strain_spring = 0, turn_spring = 0; ///< where: indices of springs
};
LinearRange linear_range(const Model& model, std::span<const double> displacement);

/// Length of the shortest edge at rest, mm.
double shortest_edge(const Model& model);

} // namespace gewebe
