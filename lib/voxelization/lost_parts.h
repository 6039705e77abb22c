#pragma once
// Parts of a mesh that are too thin or too small for the voxels.

#include "geometry/mesh.h"
#include "volume/grid.h"

#include <cstdint>

namespace gewebe {

struct LostParts {
  std::uint64_t parts = 0; ///< of faces connected by points at one position
  std::uint64_t lost = 0;  ///< with no voxel inside at their surface
};

/// Counts the parts of a mesh that left no voxel inside in a volume. A part has one if a place on
/// its surface lies in a cell of eight voxels with one inside; places are at most half a
/// voxel apart, and the search ends at the first. So a part that touches what another one filled is
/// not lost. Faces without a finite size are left out.
LostParts find_lost_parts(const TriangleMesh& mesh, const Grid& grid);

/// The share of the surface's area, 0 to 1, with no voxel inside nearer than two voxels along each
/// axis, from five thousand samples that are spread evenly over the area. So it is the share of
/// walls that are too thin for the voxels, wherever they break over more than a few voxels. 0 for a
/// surface without area.
double lost_surface(const TriangleMesh& mesh, const Grid& grid);

} // namespace gewebe
