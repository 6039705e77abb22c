#include "volume/volume_stats.h"

#include "base/parallel.h"

#include <algorithm>
#include <cmath>

namespace gewebe {
namespace {

struct LeafSums {
  double sum = 0;
  float min = HUGE_VALF, max = -HUGE_VALF;
  std::uint64_t inside = 0;
};

} // namespace

VolumeStats volume_stats(const Context& context, const Grid& grid) {
  const GridInfo& info = grid.info();
  const auto is_inside = [&](double value) {
    return info.level_set ? value < info.isovalue : value > info.isovalue;
  };
  VolumeStats stats;
  const std::vector<LeafView> leaves = grid.leaves();
  const std::vector<TileView> tiles = grid.tiles();
  std::vector<LeafSums> sums(leaves.size());
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      for (int offset = 0; offset < leaf_voxels; ++offset) {
        const float value = leaves[n].values[offset];
        sums[n].sum += static_cast<double>(value);
        sums[n].min = std::min(sums[n].min, value);
        sums[n].max = std::max(sums[n].max, value);
        sums[n].inside += is_inside(static_cast<double>(value)) ? 1 : 0;
      }
  });
  double sum = 0;
  double min = HUGE_VAL;
  double max = -HUGE_VAL;
  for (const LeafSums& leaf : sums) {
    sum += leaf.sum;
    min = std::min(min, static_cast<double>(leaf.min));
    max = std::max(max, static_cast<double>(leaf.max));
    stats.inside_voxels += leaf.inside;
  }
  for (const TileView& tile : tiles) {
    const auto dim = static_cast<std::uint64_t>(tile.dim);
    const auto value = static_cast<double>(tile.value);
    sum += value * static_cast<double>(dim * dim * dim);
    min = std::min(min, value);
    max = std::max(max, value);
    if (is_inside(value))
      stats.inside_voxels += dim * dim * dim;
  }
  const double voxel_volume = std::fabs(info.transform.determinant());
  stats.min = min <= max ? min : static_cast<double>(info.background);
  stats.max = min <= max ? max : static_cast<double>(info.background);
  stats.leaves = leaves.size();
  stats.tiles = tiles.size();
  stats.active_voxels = grid.active_voxels();
  stats.volume = sum * voxel_volume;
  stats.inside_volume = static_cast<double>(stats.inside_voxels) * voxel_volume;
  if (!grid.active_box(stats.index_min, stats.index_max)) {
    stats.index_min = {1, 1, 1};
    stats.index_max = {0, 0, 0};
    return stats;
  }
  for (int corner = 0; corner < 8; ++corner) {
    const auto pick = [&](std::size_t axis) {
      return (corner >> axis & 1) != 0 ? stats.index_max[axis] + 0.5 : stats.index_min[axis] - 0.5;
    };
    stats.box.add(info.transform.to_world({pick(0), pick(1), pick(2)}));
  }
  return stats;
}

} // namespace gewebe
