#pragma once
// A part of a model's surface with its edges, for what happens at one place of a large one.

#include "model/edges.h"
#include "model/model.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

struct SurfacePart {
  std::vector<std::uint32_t> triangles; ///< ascending
  /// Of these; corners are numbered as in the model, 3 triangle + k.
  EdgeTable edges;

  static constexpr std::size_t no_edge = SIZE_MAX;
  /// Index of an edge i < j, or no_edge.
  std::size_t find(const std::array<std::uint32_t, 2>& ends) const;
};

/// The triangles with a marked corner, in one pass over all. Edges with a marked end, and those
/// opposite to one, have all their faces here that have a marked corner or end there.
/// \param marked by node, not 0
SurfacePart surface_part(const Model& model, std::span<const std::uint8_t> marked);

/// Marks the nodes of all triangles that have a marked corner: one ring more.
void mark_neighbours(const Model& model, std::vector<std::uint8_t>& marked);

} // namespace gewebe
