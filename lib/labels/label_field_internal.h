#pragma once
// The smooth function F of label_density.h on the lattice of the labels, in a band about their
// boundary.

#include "base/context.h"
#include "labels/label_density.h"
#include "labels/label_mask.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::labels {

/// One level of the solution. Blocks of 8³ voxels, i fastest: offset i + 8 j + 64 k. A directory
/// covers the labels' box and at least 8 voxels more on each side.
struct LabelField {
  static constexpr std::int32_t outside = -1, inside = -2; ///< blocks without boundary

  LabelMask mask; ///< its transform is not used
  std::array<double, 3> spacing{};
  Int3 reach{};  ///< voxels up to which the other kind is looked for, along each axis
  Int3 blocks{}; ///< of the directory; block (0,0,0) begins at index origin
  Int3 origin{};
  std::vector<std::int32_t> directory; ///< number of a block of the band, or outside, inside
  std::vector<Int3> band;              ///< first voxels of the band's blocks, ascending by k, j, i
  std::vector<float> value;    ///< F, 512 a block; NaN farther than `reach` from the other kind
  std::vector<float> distance; ///< D with its sign, the same way

  /// Number of the block that holds voxel `v`, or outside, inside.
  std::int32_t block_at(const Int3& v) const {
    std::size_t n = 0;
    for (std::size_t a = 3; a-- > 0;) {
      const std::int32_t b = (v[a] - origin[a]) >> 3;
      if (b < 0 || b >= blocks[a])
        return outside;
      n = n * static_cast<std::size_t>(blocks[a]) + static_cast<std::size_t>(b);
    }
    return directory[n];
  }
  /// F where it is known; elsewhere NaN.
  float value_at(const Int3& v) const;
  /// Beyond the band: at least this far, by sign.
  double far() const;
};

/// Where its blocks are. \pre spacing and reach are set
void place_blocks(const Int3& size, LabelField& field);
/// Finds the band: blocks with both kinds of voxels within reach - 1.
void find_band(const Context& context, LabelField& field);
/// Fills `distance`, and `value` with the same.
void find_distance(const Context& context, LabelField& field);

/// F of the labels, all levels. \pre find_band(field) was called
void solve_label_field(const Context& context, LabelField& field, LabelDensityReport& report);

/// Moves F so that the volume about each place is that of the labels: adds, interpolated between
/// the blocks' centres, the shift by which the sum of (label - fraction inside) would vanish to
/// first order; then clamps to the bounds. The sum is weighted over the blocks about, with a
/// deviation of a block or of four of the largest spacings, whichever is more. The fraction of each
/// octant of a voxel is taken as linear over its width along the normal.
void keep_volume(const Context& context, LabelField& field);

/// The bounds of |F| where |D| is `distance`.
struct LabelBounds {
  float half_diagonal; ///< g
  float min(float distance) const {
    return distance - half_diagonal > 0.1F * distance ? distance - half_diagonal : 0.1F * distance;
  }
  float max(float distance) const { return 2 * distance; }
};
LabelBounds label_bounds(const LabelField& field);

/// Bytes that solving needs, all levels.
double label_field_bytes(const LabelField& field);

} // namespace gewebe::labels
