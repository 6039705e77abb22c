#pragma once
// What a volume holds, counted: the figures of --stats.

#include "volume/grid.h"

#include <cstdint>

namespace gewebe::volume {

struct VolumeStats {
  std::uint64_t active_voxels = 0;
  std::uint64_t inside_voxels = 0; ///< value > isovalue (a level set: < isovalue)
  std::uint64_t leaves = 0;
  std::uint64_t tiles = 0;
  double min = 0, max = 0;       ///< over leaves and tiles; background if there are none
  double volume = 0;             ///< mm³: sum of the values times the voxel's volume
  double inside_volume = 0;      ///< mm³: inside voxels times the voxel's volume
  Int3 index_min{}, index_max{}; ///< of the active voxels, inclusive; min > max if there are none
  Box3 box;                      ///< world box of the active voxels' cubes
};

/// Counts in a fixed order, so the sums do not depend on the thread count.
VolumeStats volume_stats(const Context& context, const Grid& grid);

} // namespace gewebe::volume
