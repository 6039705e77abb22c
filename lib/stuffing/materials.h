#pragma once
// A material for each tetrahedron from other volumes: a tumour in its organ, the organs of a scan.
// The centroid decides, so the interface between two materials runs along faces of the mesh, up to
// an edge away from where the volume has it. Both fill mesh.material where it is empty.

#include "base/context.h"
#include "labels/label_runs.h"
#include "tetrahedra/tet_mesh.h"
#include "volume/grid.h"

#include <cstdint>

namespace gewebe {

/// Gives the material `number` to tetrahedra whose centroid is inside `volume` (by its own
/// isovalue, interpolated trilinearly). The others keep theirs, or 0. \throw Error if the transform
/// is singular, or a value at a centroid is not finite
void set_material(const Context& context, const Grid& volume, std::int32_t number, TetMesh& mesh);

/// Gives each tetrahedron the label of the voxel that holds its centroid, 0 outside of the volume.
/// A voxel reaches half the way to its neighbours along the axes of its lattice, which may be
/// oblique. Where that label is 0 and `reach` isn't: that of the nearest centre (in mm; of equal
/// ones the first by k, j, i) with another one, of the voxels up to `reach` away along each axis.
/// Time grows with reach³. \throw Error if the transform is singular
void set_materials(const Context& context, const LabelRuns& labels, TetMesh& mesh,
                   std::int32_t reach = 0);

} // namespace gewebe
