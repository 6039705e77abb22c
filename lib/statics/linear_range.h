#pragma once
// Whether a shape is where linear elasticity may be trusted.

#include "model/model.h"

#include <array>
#include <cstdint>
#include <span>

namespace gewebe {

/// How far a shape is from where linear elasticity holds: over all edge springs, of a model with
/// tetrahedra over the edges of its triangles, the largest change of length over length, and the
/// largest turn (displacement of one end against the other, across the edge, over its length).
struct LinearRange {
  double strain = 0, turn = 0;
  std::array<std::uint32_t, 2> strain_edge{}, turn_edge{}; ///< where
};
/// \pre displacements of all nodes, or of a solid's first surface_count(model)
LinearRange linear_range(const Model& model, std::span<const double> displacement);

/// Length of the shortest of these edges at rest, mm.
double shortest_edge(const Model& model);

} // namespace gewebe
