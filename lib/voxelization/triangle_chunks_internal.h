#pragma once
// The triangles of a mesh by the rows of rays that they cross. Internal to the rules of the
// voxelizer.

#include "base/context.h"
#include "geometry/mesh.h"
#include "voxelization/ray_crossings.h"
#include "voxelization/ray_crossings_kernel_internal.h"

#include <memory>
#include <span>
#include <vector>

namespace gewebe::voxelization {

/// A mesh in the index space of the samples: coordinates as exact_predicates.h requires them,
/// magnitudes below 2^30.
struct SampleMesh {
  int samples = 1; ///< along the edge of a voxel
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;
  CpuLevel cpu = CpuLevel::baseline;
};

/// Half-open range.
struct Range {
  std::int32_t begin = 0, end = 0;
};

/// A block of consecutive triangles, sorted into the chunks that they cross.
struct Block {
  std::int32_t first = 0;           ///< chunk
  std::vector<std::uint32_t> begin; ///< per chunk from `first` on and one more: place in `members`
  std::vector<std::uint32_t> members;
  std::uint64_t skipped = 0;
};

/// Slabs in chunks of a few, so that a triangle is seldom set up more than once.
struct Chunks {
  std::int32_t slabs_each = 1;
  Range range; ///< of all chunks that are met
  std::vector<Block> blocks;

  std::size_t count() const { return static_cast<std::size_t>(range.end - range.begin); }
};

/// \throw Error if that takes too much memory
Chunks sort_triangles(const Context& context, const SampleMesh& mesh);

/// Calls visit(i, j, k) for each crossing of a ray of these rows with a triangle of the chunk, as
/// cross_triangle does.
template <class Visit>
void for_each_crossing(const SampleMesh& mesh, const Chunks& chunks, std::int32_t chunk, Range rows,
                       TieOrder ties, std::uint64_t& exact_tests, Visit&& visit) {
  const auto scalar = [&](std::uint32_t member) {
    const Triangle& t = mesh.triangles[member];
    cross_triangle(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]], rows.begin, rows.end,
                   ties, exact_tests, visit);
  };
  std::unique_ptr<CrossingBuffer> buffer;
  if (mesh.cpu != CpuLevel::baseline)
    buffer = std::make_unique<CrossingBuffer>();
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

} // namespace gewebe::voxelization
