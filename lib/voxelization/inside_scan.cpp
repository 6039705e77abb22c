#include "voxelization/inside_scan_internal.h"

#include "base/parallel.h"

#include <type_traits>

namespace gewebe::voxelization {
namespace {

template <class Leaf, class Take>
void join(std::vector<Slab<Leaf>>& slabs, std::int32_t first_slab, InsideScan& scan, Take&& take) {
  std::vector<std::span<const FullRun>> runs(slabs.size());
  for (std::size_t s = 0; s < slabs.size(); ++s)
    runs[s] = slabs[s].runs;
  scan.tiles = tiles_of_runs(runs, first_slab);
  std::size_t leaves = 0;
  for (const Slab<Leaf>& slab : slabs)
    leaves += slab.keys.size();
  scan.origins.reserve(leaves);
  if constexpr (std::is_same_v<Leaf, BitLeaf>)
    scan.bits.reserve(leaves);
  else
    scan.counts.reserve(leaves);
  for (std::size_t s = 0; s < slabs.size(); ++s) {
    const std::int32_t i = (first_slab + static_cast<std::int32_t>(s)) * volume::leaf_dim;
    for (const LeafKey& key : slabs[s].keys)
      scan.origins.push_back({i, key.j * volume::leaf_dim, key.k * volume::leaf_dim});
    for (const Leaf& leaf : slabs[s].leaves)
      take(leaf);
    slabs[s] = {};
  }
}

/// Voxel of sample f where there are n along an edge.
std::int32_t voxel_of(std::int32_t f, std::int32_t n) {
  return f >= 0 ? f / n : -((n - 1 - f) / n);
}

/// Adds the samples of a cube, cut to [begin, end) along i.
void add_cube(const volume::TileView& cube, std::int32_t n, std::int32_t begin, std::int32_t end,
              LeafMap<CountLeaf>& map) {
  const Int3 low{std::max(cube.origin[0], begin), cube.origin[1], cube.origin[2]};
  const Int3 high{std::min(cube.origin[0] + cube.dim, end), cube.origin[1] + cube.dim,
                  cube.origin[2] + cube.dim};
  if (low[0] >= high[0])
    return;
  const auto overlap = [&](std::int32_t voxel, std::size_t axis) {
    return static_cast<std::uint32_t>(std::min(high[axis], (voxel + 1) * n) -
                                      std::max(low[axis], voxel * n));
  };
  for (std::int32_t i = voxel_of(low[0], n); i * n < high[0]; ++i)
    for (std::int32_t j = voxel_of(low[1], n); j * n < high[1]; ++j)
      for (std::int32_t k = voxel_of(low[2], n); k * n < high[2]; ++k)
        map.at({j >> 3, k >> 3}).count[static_cast<std::size_t>(volume::leaf_offset({i, j, k}))] +=
            overlap(i, 0) * overlap(j, 1) * overlap(k, 2);
}

/// Adds the samples of a leaf of bits.
void add_leaf(const Int3& origin, const std::array<std::uint64_t, 8>& bits, std::int32_t n,
              LeafMap<CountLeaf>& map) {
  for (std::int32_t column = 0; column < 64; ++column) {
    const auto states = static_cast<unsigned>(
        bits[static_cast<std::size_t>(column / 8)] >> (8 * (column % 8)) & 0xff);
    if (states == 0)
      continue;
    const std::int32_t i = voxel_of(origin[0] + column / 8, n),
                       j = voxel_of(origin[1] + column % 8, n);
    for (std::int32_t c = 0; c < volume::leaf_dim; ++c)
      if ((states >> c & 1) != 0) {
        const std::int32_t k = voxel_of(origin[2] + c, n);
        ++map.at({j >> 3, k >> 3}).count[static_cast<std::size_t>(volume::leaf_offset({i, j, k}))];
      }
  }
}

} // namespace

std::vector<volume::TileView> tiles_of_runs(const std::vector<std::span<const FullRun>>& runs,
                                            std::int32_t first_slab) {
  const auto for_each_node = [](std::int32_t i, const gewebe::voxelization::FullRun& run,
                                auto&& visit) {
    for (std::int32_t k = (run.k_begin + 15) >> 4; k < run.k_end >> 4; ++k)
      visit(gewebe::Int3{i >> 4, run.j >> 4, k});
  };
  const auto for_each_run = [&](auto&& visit) {
    for (std::size_t s = 0; s < runs.size(); ++s)
      for (const gewebe::voxelization::FullRun& run : runs[s])
        visit(first_slab + static_cast<std::int32_t>(s), run);
  };
  std::vector<Int3> covered;
  for_each_run([&](std::int32_t i, const FullRun& run) {
    for_each_node(i, run, [&](const Int3& node) { covered.push_back(node); });
  });
  std::sort(covered.begin(), covered.end());
  std::vector<Int3> full;
  for (std::size_t n = 0; n + 256 <= covered.size(); ++n)
    if (covered[n] == covered[n + 255]) {
      full.push_back(covered[n]);
      n += 255;
    }
  const auto is_full = [&](const Int3& node) {
    return std::binary_search(full.begin(), full.end(), node);
  };

  std::vector<volume::TileView> tiles;
  for (const Int3& node : full)
    tiles.push_back({{node[0] * 128, node[1] * 128, node[2] * 128}, 128, 1.0f, true});
  for_each_run([&](std::int32_t i, const FullRun& run) {
    for (std::int32_t k = run.k_begin; k < run.k_end;) {
      if ((k & 15) == 0 && k + 16 <= run.k_end && is_full({i >> 4, run.j >> 4, k >> 4})) {
        k += 16;
        continue;
      }
      tiles.push_back({{i * 8, run.j * 8, k * 8}, 8, 1.0f, true});
      ++k;
    }
  });
  return tiles;
}

InsideScan join_slabs(std::vector<Slab<BitLeaf>>& slabs, std::int32_t first_slab) {
  InsideScan scan;
  join(slabs, first_slab, scan, [&](const BitLeaf& leaf) { scan.bits.push_back(leaf.word); });
  return scan;
}

InsideScan join_slabs(std::vector<Slab<CountLeaf>>& slabs, std::int32_t first_slab, int samples) {
  InsideScan scan;
  scan.samples = samples;
  join(slabs, first_slab, scan, [&](const CountLeaf& leaf) { scan.counts.push_back(leaf.count); });
  return scan;
}

InsideScan count_samples(const Context& context, const InsideScan& fine, int samples) {
  const std::int32_t rows = volume::leaf_dim * samples; // of samples in a slab
  std::int32_t low = INT32_MAX, high = INT32_MIN;
  const auto include = [&](std::int32_t i, std::int32_t dim) {
    low = std::min(low, voxel_of(i, rows));
    high = std::max(high, voxel_of(i + dim - 1, rows) + 1);
  };
  for (const Int3& origin : fine.origins)
    include(origin[0], volume::leaf_dim);
  for (const volume::TileView& tile : fine.tiles)
    include(tile.origin[0], tile.dim);
  if (low >= high)
    return {samples, {}, {}, {}, {}, {}};
  MemoryAccount memory(context, "the voxelized mesh");
  std::vector<Slab<CountLeaf>> slabs(static_cast<std::size_t>(high - low));
  parallel_blocks(context, slabs.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t s = first; s < last; ++s) {
      const std::int32_t begin = (low + static_cast<std::int32_t>(s)) * rows, end = begin + rows;
      LeafMap<CountLeaf> map(memory);
      for (const volume::TileView& tile : fine.tiles)
        add_cube(tile, samples, begin, end, map);
      for (std::size_t leaf = 0; leaf < fine.origins.size(); ++leaf)
        if (fine.origins[leaf][0] >= begin && fine.origins[leaf][0] < end)
          add_leaf(fine.origins[leaf], fine.bits[leaf], samples, map);
      // What stands in the map already are sums, not flips: their differences along k are.
      LeafMap<CountLeaf> flips(memory);
      for (std::size_t leaf = 0; leaf < map.keys.size(); ++leaf) {
        const LeafKey key = map.keys[leaf];
        for (std::size_t column = 0; column < 64; ++column) {
          std::uint32_t before = 0;
          for (std::size_t k = 0; k < 8; ++k) {
            const std::uint32_t count = map.leaves[leaf].count[8 * column + k];
            if (count != before)
              flips.at(key).count[8 * column + k] += count - before;
            before = count;
          }
          if (before != 0)
            flips.at({key.j, key.k + 1}).count[8 * column] -= before;
        }
      }
      slabs[s].memory = MemoryShare(memory);
      (void)integrate_slab(flips, samples, slabs[s]);
    }
  });
  return join_slabs(slabs, low, samples);
}

} // namespace gewebe::voxelization
