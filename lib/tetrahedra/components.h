#pragma once
// The largest components of a tetrahedral mesh.

#include "mesh/components.h"
#include "tetrahedra/tet_mesh.h"

#include <cstdint>

namespace gewebe::tetrahedra {

struct TetComponentReport {
  std::uint64_t kept = 0, dropped = 0;
  std::uint64_t dropped_points = 0, dropped_tetrahedra = 0;
  double dropped_volume = 0, largest_dropped = 0; ///< mm³
};

/// Drops components (of tetrahedra connected by corners) by their volume; of equal ones the one
/// with the first point counts as larger. What stays keeps its order, points that only they use
/// vanish. \pre check_mesh(mesh) passes
TetComponentReport keep_components(TetMesh& mesh, const mesh::ComponentChoice& choice);

/// Number of components.
std::uint64_t component_count(const TetMesh& mesh);

} // namespace gewebe::tetrahedra
