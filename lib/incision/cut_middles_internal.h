#pragma once
// The middles of edges of a quadratic solid that has been cut by its corners.

#include "incision/cut_region_internal.h"
#include "incision/cut_tetrahedra.h"

#include <cstdint>
#include <span>

namespace gewebe::incision {

/// \throw Error if an edge of the region is curved
void check_straight(const tetrahedra::TetMesh& mesh, const CutRegion& region);

/// Adds middles of edges to all changed tetrahedra, to the wall and the surface. Edges between
/// nodes that were joined before keep their middles, copies of such edges get copies, other edges
/// get new middles.
/// \param original  by corner: the former node that it is, or is a copy of
/// \pre `cut` has its corners, and the former middles of the former tetrahedra
/// \throw Error if there are too many nodes
void add_middles(const tetrahedra::TetMesh& before, std::span<const std::uint32_t> original,
                 TetCut& cut);

} // namespace gewebe::incision
