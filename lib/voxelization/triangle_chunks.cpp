#include "voxelization/triangle_chunks_internal.h"

#include "base/error.h"
#include "base/parallel.h"
#include "volume/grid.h"

#include <algorithm>

namespace gewebe::voxelization {
namespace {

/// Sample rows that a triangle may cross; empty if none.
Range rows_of(const SampleMesh& mesh, const Triangle& t) {
  const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
  const double y_min = std::min(std::min(a.y, b.y), c.y), y_max = std::max(std::max(a.y, b.y), c.y);
  if (ceil_int(y_min) > floor_int(y_max))
    return {0, 0};
  const double x_min = std::min(std::min(a.x, b.x), c.x), x_max = std::max(std::max(a.x, b.x), c.x);
  return {ceil_int(x_min), ceil_int(x_max)};
}

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

} // namespace

Chunks sort_triangles(const Context& context, const SampleMesh& mesh) {
  Box3 box;
  for (const Vec3& p : mesh.points) {
    box.min.x = std::min(box.min.x, p.x);
    box.max.x = std::max(box.max.x, p.x);
  }
  const double slabs = (box.max.x - box.min.x) / (volume::leaf_dim * mesh.samples) + 1;
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
        sort_block(context, mesh, begin, end, chunks.slabs_each * volume::leaf_dim * mesh.samples);
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

} // namespace gewebe::voxelization
