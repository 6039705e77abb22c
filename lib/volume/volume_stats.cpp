#include "volume/volume_stats.h"

#include "base/parallel.h"

#include <cmath>

namespace gewebe::volume {
namespace {

struct Sums {
  double sum = 0;
  std::uint64_t inside = 0;
};

/// `below`: inside is value < threshold, else value > threshold.
Sums leaf_sums(const float* v, float threshold, bool below) {
  // Eight sums side by side, by name: in a row each waits for the one before.
  double a = 0, b = 0, c = 0, d = 0, e = 0, f = 0, g = 0, h = 0;
  for (int n = 0; n < leaf_voxels; n += 8) {
    a += static_cast<double>(v[n]);
    b += static_cast<double>(v[n + 1]);
    c += static_cast<double>(v[n + 2]);
    d += static_cast<double>(v[n + 3]);
    e += static_cast<double>(v[n + 4]);
    f += static_cast<double>(v[n + 5]);
    g += static_cast<double>(v[n + 6]);
    h += static_cast<double>(v[n + 7]);
  }
  std::int32_t inside = 0;
  if (below)
    for (int n = 0; n < leaf_voxels; ++n)
      inside += v[n] < threshold ? 1 : 0;
  else
    for (int n = 0; n < leaf_voxels; ++n)
      inside += v[n] > threshold ? 1 : 0;
  return {((a + b) + (c + d)) + ((e + f) + (g + h)), static_cast<std::uint64_t>(inside)};
}

/// The single precision number that floats may be compared with instead of `isovalue`.
float threshold_for(double isovalue, bool below) {
  const auto near = static_cast<float>(isovalue);
  if (below)
    return static_cast<double>(near) < isovalue ? std::nextafter(near, HUGE_VALF) : near;
  return static_cast<double>(near) > isovalue ? std::nextafter(near, -HUGE_VALF) : near;
}

} // namespace

VolumeStats volume_stats(const Context& context, const Grid& grid) {
  const GridInfo& info = grid.info();
  const auto is_inside = [&](double value) {
    return info.level_set ? value < info.isovalue : value > info.isovalue;
  };
  VolumeStats stats;
  const std::vector<LeafView> leaves = grid.leaves();
  const std::vector<TileView> tiles = grid.tiles();
  std::vector<Sums> sums(leaves.size());
  const float threshold = threshold_for(info.isovalue, info.level_set);
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, leaves.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      sums[n] = leaf_sums(leaves[n].values, threshold, info.level_set);
  });
  double sum = 0;
  for (const Sums& leaf : sums) {
    sum += leaf.sum;
    stats.inside_voxels += leaf.inside;
  }
  for (const TileView& tile : tiles) {
    const auto dim = static_cast<std::uint64_t>(tile.dim);
    const auto value = static_cast<double>(tile.value);
    sum += value * static_cast<double>(dim * dim * dim);
    if (is_inside(value))
      stats.inside_voxels += dim * dim * dim;
  }
  const double voxel_volume = std::fabs(info.transform.determinant());
  const ValueSummary& range = grid.summary(context);
  stats.min = static_cast<double>(range.min);
  stats.max = static_cast<double>(range.max);
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

} // namespace gewebe::volume
