#include "volume/inside_scan_internal.h"

namespace gewebe {
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
    const std::int32_t i = (first_slab + static_cast<std::int32_t>(s)) * leaf_dim;
    for (const LeafKey& key : slabs[s].keys)
      scan.origins.push_back({i, key.j * leaf_dim, key.k * leaf_dim});
    for (const Leaf& leaf : slabs[s].leaves)
      take(leaf);
    slabs[s] = {};
  }
}

} // namespace

std::vector<TileView> tiles_of_runs(const std::vector<std::span<const FullRun>>& runs,
                                    std::int32_t first_slab) {
  const auto for_each_node = [](std::int32_t i, const FullRun& run, auto&& visit) {
    for (std::int32_t k = (run.k_begin + 15) >> 4; k < run.k_end >> 4; ++k)
      visit(Int3{i >> 4, run.j >> 4, k});
  };
  const auto for_each_run = [&](auto&& visit) {
    for (std::size_t s = 0; s < runs.size(); ++s)
      for (const FullRun& run : runs[s])
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

  std::vector<TileView> tiles;
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

} // namespace gewebe
