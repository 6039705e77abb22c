#pragma once
// Part of a model's surface with its edges, for local changes of a large surface.

#include "mesh/edges.h"
#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::model {

struct SurfacePart {
  std::vector<std::uint32_t> triangles; ///< ascending
  /// Of these; corners are numbered as in the model, 3 triangle + k.
  mesh::EdgeTable edges;
};

/// The triangles with a marked corner, in one pass over all. Edges with a marked end, and those
/// opposite to one, have all their faces here that have a marked corner or end there.
/// \param marked by node, not 0
SurfacePart surface_part(const Model& model, std::span<const std::uint8_t> marked);

/// Marks the nodes of all triangles that have a marked corner: one ring more.
void mark_neighbours(const Model& model, std::vector<std::uint8_t>& marked);

} // namespace gewebe::model
