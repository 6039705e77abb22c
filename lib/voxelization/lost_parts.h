#pragma once
// Finds parts of a mesh that a voxelization lost because they are too thin or too small for the
// voxels.

#include "geometry/mesh.h"
#include "volume/grid.h"

#include <cstdint>

namespace gewebe::voxelization {

struct LostParts {
  std::uint64_t parts = 0; ///< of faces connected by points at one position
  std::uint64_t lost = 0;  ///< with no voxel inside at their surface
};

/// Counts the parts of a mesh that left no voxel inside in a volume. A part is not lost if some
/// point of its surface lies in a cell of eight voxels with one inside. Points are sampled at most
/// half a voxel apart. So a part that touches voxels of another part is not lost either. Faces
/// without a finite size are left out.
LostParts find_lost_parts(const TriangleMesh& mesh, const volume::Grid& grid);

/// Estimates the share of the surface's area, 0 to 1, that has no inside voxel within two voxels
/// along each axis. Uses five thousand samples, evenly spread over the area. The result is large
/// where walls are too thin for the voxels and break over more than a few voxels. 0 for a surface
/// without area.
double lost_surface(const TriangleMesh& mesh, const volume::Grid& grid);

} // namespace gewebe::voxelization
