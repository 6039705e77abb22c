#include "volume/parity_scan_internal.h"
// Based on: E.-A. Karabassi, G. Papaioannou, T. Theoharis, A Fast Depth-Buffer-Based Voxelization
// Algorithm, 1999 (the report's method, of which the rays along one axis remain); the parity rule
// after F. S. Nooruddin, G. Turk, Simplification and Repair of Polygonal Models Using Volumetric
// Techniques, 2003.

#include "base/error.h"
#include "base/parallel.h"
#include "volume/inside_scan_internal.h"
#include "volume/ray_crossings_internal.h"
#include "volume/ray_crossings_kernel_internal.h"

#include <memory>

namespace gewebe {
namespace {

std::int32_t floor_divide(std::int32_t n, std::int32_t by) {
  const std::int32_t quotient = n / by;
  return quotient - (n % by < 0 ? 1 : 0);
}

// ---- which triangles a chunk of slabs meets

/// Half-open range.
struct Range {
  std::int32_t begin = 0, end = 0;
};

/// Sample rows that a triangle may cross; empty if none.
Range rows_of(const SampleMesh& mesh, const Triangle& t) {
  const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
  const double y_min = std::min(std::min(a.y, b.y), c.y), y_max = std::max(std::max(a.y, b.y), c.y);
  if (ceil_int(y_min) > floor_int(y_max))
    return {0, 0};
  const double x_min = std::min(std::min(a.x, b.x), c.x), x_max = std::max(std::max(a.x, b.x), c.x);
  return {ceil_int(x_min), ceil_int(x_max)};
}

/// A block of consecutive triangles, sorted into the chunks that they cross.
struct Block {
  std::int32_t first = 0;           ///< chunk
  std::vector<std::uint32_t> begin; ///< per chunk from `first` on and one more: place in `members`
  std::vector<std::uint32_t> members;
  std::uint64_t skipped = 0;
};

Block sort_block(const Context& context, const SampleMesh& mesh, std::size_t begin, std::size_t end,
                 std::int32_t chunk_rows) {
  Block block;
  std::vector<Range> chunks(end - begin);
  Range all{INT32_MAX, INT32_MIN};
  const double chunks_per_row = 1.0 / chunk_rows;
  for (std::size_t n = begin; n < end; ++n) {
    const Range rows = rows_of(mesh, mesh.triangles[n]);
    if (rows.begin >= rows.end) {
      ++block.skipped;
      continue;
    }
    // Half a row keeps the quotient away from integers, by more than rounding can move it.
    const Range c{floor_int((rows.begin + 0.5) * chunks_per_row),
                  floor_int((rows.end - 0.5) * chunks_per_row) + 1};
    chunks[n - begin] = c;
    all = {std::min(all.begin, c.begin), std::max(all.end, c.end)};
  }
  if (all.begin >= all.end)
    return block;
  block.first = all.begin;
  block.begin.assign(static_cast<std::size_t>(all.end - all.begin) + 1, 0);
  const auto place = [&](std::int32_t chunk) -> std::uint32_t& {
    return block.begin[static_cast<std::size_t>(chunk - all.begin)];
  };
  double members = 0;
  for (const Range& c : chunks)
    members += c.end - c.begin;
  require_memory(context, members < 0x1p32 ? 4 * members : HUGE_VAL, "a block of long triangles");
  std::uint32_t total = 0;
  for (const Range& c : chunks)
    for (std::int32_t chunk = c.begin; chunk < c.end; ++chunk)
      ++place(chunk);
  for (std::uint32_t& b : block.begin) // to the ends of the chunks' places
    b = total += b;
  block.members.resize(total);
  for (std::size_t n = chunks.size(); n-- > 0;) // which become the beginnings again
    for (std::int32_t chunk = chunks[n].begin; chunk < chunks[n].end; ++chunk)
      block.members[--place(chunk)] = static_cast<std::uint32_t>(begin + n);
  return block;
}

/// Slabs in chunks of a few, so that a triangle is seldom set up more than once.
struct Chunks {
  std::int32_t slabs_each = 1;
  Range range; ///< of all chunks that are met
  std::vector<Block> blocks;

  std::size_t count() const { return static_cast<std::size_t>(range.end - range.begin); }
};

Chunks sort_triangles(const Context& context, const SampleMesh& mesh) {
  Box3 box;
  for (const Vec3& p : mesh.points) {
    box.min.x = std::min(box.min.x, p.x);
    box.max.x = std::max(box.max.x, p.x);
  }
  const double slabs = (box.max.x - box.min.x) / (leaf_dim * mesh.samples) + 1;
  Chunks chunks;
  // Samples that are counted take a list of crossings per row, so one slab is much.
  if (mesh.samples == 1)
    chunks.slabs_each = static_cast<std::int32_t>(std::clamp(slabs / 32, 1.0, 4.0));
  const double count = slabs / chunks.slabs_each + 2;
  const std::size_t grain = 8192 + static_cast<std::size_t>(count);
  const double blocks = static_cast<double>(mesh.triangles.size()) / static_cast<double>(grain) + 1;
  require_memory(context, 4 * count * blocks + 16.0 * static_cast<double>(mesh.triangles.size()),
                 "sorting the triangles into slabs");
  chunks.blocks.resize((mesh.triangles.size() + grain - 1) / grain);
  Context quiet = context;
  quiet.progress = nullptr;
  parallel_blocks(quiet, mesh.triangles.size(), grain, [&](std::size_t begin, std::size_t end) {
    chunks.blocks[begin / grain] =
        sort_block(context, mesh, begin, end, chunks.slabs_each * leaf_dim * mesh.samples);
  });
  chunks.range = {INT32_MAX, INT32_MIN};
  for (const Block& b : chunks.blocks)
    if (!b.members.empty())
      chunks.range = {
          std::min(chunks.range.begin, b.first),
          std::max(chunks.range.end, b.first + static_cast<std::int32_t>(b.begin.size()) - 1)};
  if (chunks.range.begin > chunks.range.end)
    chunks.range = {0, 0};
  return chunks;
}

template <class Visit>
void for_each_crossing(const SampleMesh& mesh, const Chunks& chunks, std::int32_t chunk, Range rows,
                       std::uint64_t& exact_tests, Visit&& visit) {
  const auto scalar = [&](std::uint32_t member) {
    const Triangle& t = mesh.triangles[member];
    cross_triangle(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], rows.begin, rows.end,
                   exact_tests, visit);
  };
  std::unique_ptr<CrossingBuffer> buffer;
  if (mesh.cpu != CpuLevel::baseline)
    buffer.reset(new CrossingBuffer); // left as it is: the kernel says how much of it holds
  for (const Block& block : chunks.blocks) {
    const std::int32_t c = chunk - block.first;
    if (c < 0 || c + 1 >= static_cast<std::int32_t>(block.begin.size()))
      continue;
    const auto n = static_cast<std::size_t>(c);
    const std::uint32_t* const members = block.members.data() + block.begin[n];
    const std::size_t count = block.begin[n + 1] - block.begin[n];
    if (!buffer) {
      std::for_each_n(members, count, scalar);
      continue;
    }
    const TriangleList list{&mesh.points[0].x, &mesh.triangles[0][0], members, count, rows.begin,
                            rows.end};
    for (std::size_t next = 0; next < count;) {
      next = cross_small_triangles_avx2(list, next, *buffer);
      for (std::size_t m = 0; m < buffer->count; ++m)
        visit(buffer->i[m], buffer->j[m], buffer->k[m]);
      std::for_each_n(buffer->left, buffer->left_count, scalar);
    }
  }
}

// ---- one chunk

struct Counters {
  std::uint64_t crossings = 0, odd_rays = 0, exact_tests = 0;
};

/// One sample per voxel: flips go straight to the bits.
void scan_chunk(const SampleMesh& mesh, const Chunks& chunks, std::int32_t chunk,
                std::span<Slab<BitLeaf>> slabs, Counters& counters) {
  std::array<LeafMap<BitLeaf>, 4> maps;
  const std::int32_t first = chunk * chunks.slabs_each * leaf_dim;
  for_each_crossing(mesh, chunks, chunk, {first, first + chunks.slabs_each * leaf_dim},
                    counters.exact_tests, [&](std::int32_t i, std::int32_t j, std::int32_t k) {
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
                std::span<Slab<CountLeaf>> slabs, Counters& counters) {
  constexpr std::int32_t rows_at_once = 64;
  LeafMap<CountLeaf> map;
  const std::int32_t n = mesh.samples;
  const std::int32_t first = chunk * leaf_dim * n, last = first + leaf_dim * n;
  std::vector<std::vector<std::uint64_t>> rows(rows_at_once); // crossings, j above k, both biased
  constexpr std::uint32_t bias = 0x80000000u;
  for (std::int32_t row = first; row < last; row += rows_at_once) {
    const std::int32_t row_end = std::min(last, row + rows_at_once);
    for_each_crossing(mesh, chunks, chunk, {row, row_end}, counters.exact_tests,
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
std::vector<Slab<Leaf>> scan_chunks(const Context& context, const SampleMesh& mesh,
                                    const Chunks& chunks, VoxelizeReport& report,
                                    const std::function<void()>& beside) {
  const auto each = static_cast<std::size_t>(chunks.slabs_each);
  std::vector<Slab<Leaf>> slabs(chunks.count() * each);
  std::vector<Counters> counters(chunks.count());
  parallel_blocks(context, chunks.count() + 1, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      if (n == 0)
        beside();
      else
        scan_chunk(mesh, chunks, chunks.range.begin + static_cast<std::int32_t>(n - 1),
                   std::span(slabs).subspan((n - 1) * each, each), counters[n - 1]);
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
  if (mesh.samples == 1) {
    auto slabs = scan_chunks<BitLeaf>(context, mesh, chunks, report, beside);
    return join_slabs(slabs, first_slab);
  }
  auto slabs = scan_chunks<CountLeaf>(context, mesh, chunks, report, beside);
  return join_slabs(slabs, first_slab, mesh.samples);
}

} // namespace gewebe
