#pragma once
// What --stats says about volumes, the same for every program that makes one.

#include "tools/cli/cli.h"
#include "volume/grid.h"

namespace gewebe::cli {

/// Adds voxel size, leaves, tiles, active and inside voxels, volume, box, min, max and digest of
/// the grid. Costs a pass over the volume, so call it only for --stats.
void report_volume(Run& run, const volume::Grid& grid);

} // namespace gewebe::cli
