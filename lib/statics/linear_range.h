#pragma once
// Check whether a shape is in the range of linear elasticity.

#include "model/model.h"

#include <array>
#include <cstdint>
#include <span>

namespace gewebe::statics {

/// Largest strain and rotation of an edge, to be compared with the range of linear elasticity. The
/// strain is the change of length over length. The rotation is the displacement of one end against
/// the other, across the edge, over its length. Edges are all edge springs, or, of a model with
/// tetrahedra, the edges of its triangles.
struct LinearRange {
  double strain = 0, turn = 0;
  std::array<std::uint32_t, 2> strain_edge{}, turn_edge{}; ///< where
};
/// \pre displacements of all nodes, or of a solid's first surface_count(model)
LinearRange linear_range(const model::Model& model, std::span<const double> displacement);

/// Length of the shortest edge at rest, mm, of the same edges.
double shortest_edge(const model::Model& model);

} // namespace gewebe::statics
