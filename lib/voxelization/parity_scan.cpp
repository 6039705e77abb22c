#include "voxelization/parity_scan_internal.h"
// Based on: E.-A. Karabassi, G. Papaioannou, T. Theoharis, A Fast Depth-Buffer-Based Voxelization
// Algorithm, 1999 (the report's method, reduced to rays along one axis); the parity rule
// after F. S. Nooruddin, G. Turk, Simplification and Repair of Polygonal Models Using Volumetric
// Techniques, 2003.

#include "base/error.h"
#include "base/parallel.h"
#include "voxelization/inside_scan_internal.h"
#include "voxelization/triangle_chunks_internal.h"

namespace gewebe::voxelization {
namespace {

std::int32_t floor_divide(std::int32_t n, std::int32_t by) {
  const std::int32_t quotient = n / by;
  return quotient - (n % by < 0 ? 1 : 0);
}

// ---- one chunk

struct Counters {
  std::uint64_t crossings = 0, odd_rays = 0, exact_tests = 0;
};

/// One sample per voxel: flips go straight to the bits.
void scan_chunk(const SampleMesh& mesh, const Chunks& chunks, std::int32_t chunk,
                std::span<Slab<BitLeaf>> slabs, Counters& counters, MemoryAccount& memory) {
  std::array<LeafMap<BitLeaf>, 4> maps = leaf_maps<BitLeaf>(memory);
  const std::int32_t first = chunk * chunks.slabs_each * volume::leaf_dim;
  for_each_crossing(mesh, chunks, chunk, {first, first + chunks.slabs_each * volume::leaf_dim},
                    TieOrder::xyz, counters.exact_tests,
                    [&](std::int32_t i, std::int32_t j, std::int32_t k) {
                      const int bit = (j & 7) * 8 + (k & 7);
                      maps[static_cast<std::size_t>((i - first) >> 3)]
                          .at({j >> 3, k >> 3})
                          .word[static_cast<std::size_t>(i & 7)] ^= std::uint64_t{1} << bit;
                      ++counters.crossings;
                    });
  for (std::size_t s = 0; s < slabs.size(); ++s)
    counters.odd_rays += integrate_slab(maps[s], 1, slabs[s]);
}

/// Coarse voxel of fine sample f, rounding down, and the sample's place in it.
struct Place {
  std::int32_t voxel, rest;
};
Place place_of(std::int32_t fine, std::int32_t samples) {
  const std::int32_t voxel = floor_divide(fine, samples);
  return {voxel, fine - voxel * samples};
}

/// samples³ samples per voxel: the crossings of a ray are paired, and each pair adds its samples.
void scan_chunk(const SampleMesh& mesh, const Chunks& chunks, std::int32_t chunk,
                std::span<Slab<CountLeaf>> slabs, Counters& counters, MemoryAccount& memory) {
  constexpr std::int32_t rows_at_once = 64;
  LeafMap<CountLeaf> map(memory);
  const std::int32_t n = mesh.samples;
  const std::int32_t first = chunk * volume::leaf_dim * n, last = first + volume::leaf_dim * n;
  std::vector<std::vector<std::uint64_t>> rows(rows_at_once); // crossings, j above k, both biased
  constexpr std::uint32_t bias = 0x80000000u;
  for (std::int32_t row = first; row < last; row += rows_at_once) {
    const std::int32_t row_end = std::min(last, row + rows_at_once);
    for_each_crossing(mesh, chunks, chunk, {row, row_end}, TieOrder::xyz, counters.exact_tests,
                      [&](std::int32_t i, std::int32_t j, std::int32_t k) {
                        rows[static_cast<std::size_t>(i - row)].push_back(
                            std::uint64_t{static_cast<std::uint32_t>(j) + bias} << 32 |
                            (static_cast<std::uint32_t>(k) + bias));
                      });
    for (std::int32_t i = row; i < row_end; ++i) {
      std::vector<std::uint64_t>& crossings = rows[static_cast<std::size_t>(i - row)];
      std::sort(crossings.begin(), crossings.end());
      counters.crossings += crossings.size();
      const std::int32_t column_i = (place_of(i, n).voxel & 7) << 6;
      for (std::size_t c = 0; c < crossings.size();) {
        const std::uint64_t ray = crossings[c] >> 32;
        std::size_t end = c;
        while (end < crossings.size() && crossings[end] >> 32 == ray)
          ++end;
        if ((end - c) % 2 != 0) {
          ++counters.odd_rays;
          c = end;
          continue;
        }
        const std::int32_t j =
            place_of(static_cast<std::int32_t>(static_cast<std::uint32_t>(ray) - bias), n).voxel;
        const std::int32_t column = column_i | (j & 7) << 3;
        for (std::uint32_t sign = 1; c < end; ++c, sign = 0u - sign) {
          const auto k = static_cast<std::int32_t>(static_cast<std::uint32_t>(crossings[c]) - bias);
          const Place place = place_of(k, n);
          const auto add = [&](std::int32_t voxel, std::int32_t samples) {
            map.at({j >> 3, voxel >> 3}).count[static_cast<std::size_t>(column | (voxel & 7))] +=
                sign * static_cast<std::uint32_t>(samples);
          };
          add(place.voxel, n - place.rest);
          if (place.rest > 0)
            add(place.voxel + 1, place.rest);
        }
      }
      crossings.clear();
    }
  }
  (void)integrate_slab(map, n, slabs[0]);
}

// ---- all chunks

template <class Leaf>
std::vector<Slab<Leaf>> scan_chunks(const Context& context, MemoryAccount& memory,
                                    const SampleMesh& mesh, const Chunks& chunks,
                                    VoxelizeReport& report, const std::function<void()>& beside) {
  const auto each = static_cast<std::size_t>(chunks.slabs_each);
  std::vector<Slab<Leaf>> slabs(chunks.count() * each);
  for (Slab<Leaf>& slab : slabs)
    slab.memory = MemoryShare(memory);
  std::vector<Counters> counters(chunks.count());
  parallel_blocks(context, chunks.count() + 1, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      if (n == 0)
        beside();
      else
        scan_chunk(mesh, chunks, chunks.range.begin + static_cast<std::int32_t>(n - 1),
                   std::span(slabs).subspan((n - 1) * each, each), counters[n - 1], memory);
    }
  });
  for (const Counters& c : counters) {
    report.crossings += c.crossings;
    report.odd_rays += c.odd_rays;
    report.exact_tests += c.exact_tests;
  }
  return slabs;
}

} // namespace

InsideScan parity_scan(const Context& context, const SampleMesh& mesh, VoxelizeReport& report,
                       const std::function<void()>& beside) {
  const Chunks chunks = sort_triangles(context, mesh);
  for (const Block& block : chunks.blocks)
    report.triangles_skipped += block.skipped;
  const std::int32_t first_slab = chunks.range.begin * chunks.slabs_each;
  MemoryAccount memory(context, "the voxelized mesh");
  if (mesh.samples == 1) {
    auto slabs = scan_chunks<BitLeaf>(context, memory, mesh, chunks, report, beside);
    return join_slabs(slabs, first_slab);
  }
  auto slabs = scan_chunks<CountLeaf>(context, memory, mesh, chunks, report, beside);
  return join_slabs(slabs, first_slab, mesh.samples);
}

} // namespace gewebe::voxelization
