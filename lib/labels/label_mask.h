#pragma once
// Which voxels of a label volume are meant, one bit each, and where they lie.

#include "volume/grid.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::labels {

/// A box of voxels on any affine lattice. Voxel (i, j, k) has its centre at world transform(i, j,
/// k); what lies outside the box belongs to no label.
struct LabelMask {
  Int3 size{}; ///< voxels along i, j, k
  volume::GridTransform transform;
  /// Row (j, k) begins at word (k·size[1] + j)·row_words(); voxel i is bit i & 63 of word i >> 6.
  /// Bits beyond size[0] are 0.
  std::vector<std::uint64_t> bits;

  std::size_t row_words() const { return (static_cast<std::size_t>(size[0]) + 63) / 64; }
  std::size_t row(std::int32_t j, std::int32_t k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size[1]) +
            static_cast<std::size_t>(j)) *
           row_words();
  }
  bool inside(const Int3& v) const {
    for (std::size_t a = 0; a < 3; ++a)
      if (v[a] < 0 || v[a] >= size[a])
        return false;
    return (bits[row(v[1], v[2]) + static_cast<std::size_t>(v[0] >> 6)] >> (v[0] & 63) & 1) != 0;
  }
};

} // namespace gewebe::labels
