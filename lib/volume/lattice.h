#pragma once
// The lattices that --voxel, --dim and --like stand for (metaball2vol(1), voxelize(1)).

#include "volume/grid.h"

namespace gewebe::volume {

/// Transform of --dim N: voxel edge = longest side of `box` / N, centres at integer multiples of
/// it. \throw Error if the box is empty or has no extent
GridTransform lattice_for_dim(const Box3& box, std::int64_t dim);

/// Voxel centres inside a world box, as an inclusive index range (cubic or rotated lattice: the
/// range covers the box). Returns false if there is none. \throw Error if an index would leave
/// ±2^30
bool index_range(const GridTransform& transform, const Box3& box, Int3& min, Int3& max);

} // namespace gewebe::volume
