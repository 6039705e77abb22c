#pragma once
// Report of mc-opt about its mesh.

#include "geometry/mesh.h"
#include "surface/marching_cubes.h"
#include "surface/snapping.h"
#include "tools/cli/cli.h"
#include "volume/grid.h"

namespace gewebe::cli {

/// What was visited and merged.
void report_meshing(Stats& stats, const volume::Grid& grid, const surface::IsoSurface& surface,
                    const surface::SnapReport& snapped);

/// Topology, size, shape and digest of a mesh, into the stats of the run.
void report_surface(Run& run, const TriangleMesh& mesh, bool self_intersections);

} // namespace gewebe::cli
