#pragma once
// Crossings of many small triangles at once. Internal to the voxelizer. Only what is certain in
// double is answered, so every CPU level gives the same crossings.

#include <cstddef>
#include <cstdint>

namespace gewebe::voxelization {

/// Triangles of a list, and the rows of rays that matter.
struct TriangleList {
  const double* points;         ///< x y z of each point
  const std::uint32_t* corners; ///< three of each triangle
  const std::uint32_t* members; ///< triangles
  std::size_t count;            ///< of members
  std::int32_t row_begin, row_end;
};

/// Most rays in the box of a triangle that the kernel takes.
inline constexpr std::int32_t small_triangle_rays = 1024;
inline constexpr std::size_t crossing_capacity = 4096;

/// Crossings (i, j, k) as cross_triangle emits them, and the triangles to call it for.
struct CrossingBuffer {
  std::size_t count, left_count;
  std::int32_t i[crossing_capacity], j[crossing_capacity], k[crossing_capacity];
  std::uint32_t left[crossing_capacity];
};

/// Takes triangles from place `next` of the list on until all are done or the buffer, emptied
/// first, is nearly full; returns the place to go on from. \pre coordinates as for cross_triangle
std::size_t cross_small_triangles_avx2(const TriangleList& list, std::size_t next,
                                       CrossingBuffer& buffer);

} // namespace gewebe::voxelization
