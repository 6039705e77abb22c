#pragma once
// The repairs for which CGAL is needed.

#include "geometry/mesh.h"
#include "repair/repair.h"

namespace gewebe::repair {

/// Removes faces without area and fills holes, as the options ask, and counts.
void with_cgal(TriangleMesh& mesh, const RepairOptions& options, RepairReport& report);

} // namespace gewebe::repair
