#pragma once
// Report about a tetrahedral mesh.

#include "geometry/mesh.h"
#include "tetrahedra/tet_mesh.h"
#include "tools/cli/cli.h"

namespace gewebe::cli {

/// Topology, size, shape, materials and digest of a mesh, into the stats of the run.
/// \return the boundary
TriangleMesh report_tetrahedra(Run& run, const tetrahedra::TetMesh& mesh);

} // namespace gewebe::cli
