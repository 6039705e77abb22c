#pragma once
// The label of each voxel of a label volume, and where the voxels lie.

#include "volume/grid.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::labels {

/// A box of voxels on any affine lattice, each row as runs of equal labels: organs take some bytes
/// a row, where an array would take as much as the scan. Voxel (i, j, k) has its centre at world
/// transform(i, j, k); what lies outside the box has label 0.
struct LabelRuns {
  struct Run {
    std::int32_t end = 0; ///< the first voxel behind it
    std::int32_t label = 0;
    bool operator==(const Run&) const = default;
  };
  Int3 size{}; ///< voxels along i, j, k
  volume::GridTransform transform;
  /// Row (j, k), r = k·size[1] + j, is runs[rows[r]] up to runs[rows[r + 1]], ascending; the last
  /// one ends at size[0]. \pre rows begins with 0 and has size[1]·size[2] + 1 entries
  std::vector<Run> runs;
  std::vector<std::size_t> rows;

  std::int32_t at(const Int3& v) const {
    for (std::size_t a = 0; a < 3; ++a)
      if (v[a] < 0 || v[a] >= size[a])
        return 0;
    const std::size_t r = static_cast<std::size_t>(v[2]) * static_cast<std::size_t>(size[1]) +
                          static_cast<std::size_t>(v[1]);
    const auto row = std::span(runs).subspan(rows[r], rows[r + 1] - rows[r]);
    return std::upper_bound(row.begin(), row.end(), v[0],
                            [](std::int32_t i, const Run& run) { return i < run.end; })
        ->label;
  }
};

} // namespace gewebe::labels
