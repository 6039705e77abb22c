#pragma once
// The grey values of a scan, and where its voxels lie.

#include "volume/grid.h"

#include <cstddef>
#include <vector>

namespace gewebe::labels {

/// A box of voxels on any affine lattice. Voxel (i, j, k) has its centre at world transform(i, j,
/// k) and the value values[(k·size[1] + j)·size[0] + i]: Hounsfield units of a CT, or whatever the
/// scan has; NaN where it has none.
struct GreyVolume {
  Int3 size{}; ///< voxels along i, j, k
  volume::GridTransform transform;
  std::vector<float> values;

  std::size_t row(std::int32_t j, std::int32_t k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size[1]) +
            static_cast<std::size_t>(j)) *
           static_cast<std::size_t>(size[0]);
  }
};

} // namespace gewebe::labels
