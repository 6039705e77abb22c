#pragma once
// A material for each tetrahedron from other volumes: a tumour in its organ.

#include "base/context.h"
#include "tetrahedra/tet_mesh.h"
#include "volume/grid.h"

#include <span>

namespace gewebe {

/// The material of a tetrahedron is the number, from 1, of the last of `volumes` whose inside (by
/// its own isovalue, interpolated trilinearly) holds the tetrahedron's centroid, or 0. So the
/// interface between two materials runs along faces of the mesh, up to an edge away from the
/// volume's surface. Fills in mesh.material. \throw Error if a transform is singular, or a value is
/// not finite
void set_materials(const Context& context, std::span<const Grid> volumes, TetMesh& mesh);

} // namespace gewebe
