#pragma once
// Normals of an isosurface from the volume that it was made of.

#include "base/context.h"
#include "base/mesh.h"
#include "volume/grid.h"

#include <cstdint>

namespace gewebe {

struct GradientNormalsReport {
  std::uint64_t from_faces = 0; ///< points whose normal is that of their faces
};

/// Gives each point of the mesh the direction in which the volume falls steepest (in a level set:
/// rises), from Field::gradient. Where that direction is not defined, or points to the wrong side
/// of the faces round the point (as on sheets thinner than two voxels, where differences reach
/// across), the normal is the faces' own, weighted by area; (0, 0, 1) where these have no area. The
/// result does not depend on the number of threads.
///
/// \pre mesh is an isosurface of grid, in the world, counter-clockwise seen from outside
GradientNormalsReport gradient_normals(const Context& context, const Grid& grid,
                                       TriangleMesh& mesh);

} // namespace gewebe
