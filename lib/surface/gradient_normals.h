#pragma once
// Normals of an isosurface from the gradient of its volume.

#include "base/context.h"
#include "geometry/mesh.h"
#include "volume/grid.h"

#include <cstdint>

namespace gewebe::surface {

struct GradientNormalsReport {
  std::uint64_t from_faces = 0; ///< points whose normal is that of their faces
};

/// Gives each point of the mesh the direction of steepest descent of the volume (in a level set: of
/// steepest ascent), from Field::gradient. If that direction is not defined, or points to the wrong
/// side of the faces round the point, the normal is that of the faces, weighted by area. (The wrong
/// side occurs on sheets thinner than two voxels, where differences reach across.) It is (0, 0, 1)
/// if the faces have no area. The result does not depend on the number of threads.
///
/// \pre mesh is an isosurface of grid, in the world, counter-clockwise seen from outside
GradientNormalsReport gradient_normals(const Context& context, const volume::Grid& grid,
                                       TriangleMesh& mesh);

} // namespace gewebe::surface
