#pragma once
// Where the materials of a solid come from: a tumour in its organ, the organs of a scan.

#include "base/context.h"
#include "labels/label_runs.h"
#include "stuffing/stuffing.h"
#include "tetrahedra/tet_mesh.h"
#include "volume/grid.h"

#include <cstdint>

namespace gewebe {

/// 1 inside `volume` (by its own isovalue, interpolated trilinearly), else 0; what it makes throws
/// Error for a value that is not finite. \pre the volume outlives what is made of it
/// \throw Error if the transform is singular
MaterialSource inside_source(const Grid& volume);

/// The label of the voxel that holds the place, 0 outside of the volume. A voxel reaches half the
/// way to its neighbours along the axes of its lattice, which may be oblique. Where that label is 0
/// and `reach` isn't: that of the nearest centre (in mm; of equal ones the first by k, j, i) with
/// another one, of the voxels up to `reach` away along each axis. Time grows with reach³.
/// \pre the labels outlive what is made of them \throw Error if the transform is singular
MaterialSource label_source(const LabelRuns& labels, std::int32_t reach = 0);

/// Gives each tetrahedron the material of its centroid, so that the interface between two materials
/// runs along faces of the mesh. \throw what the source throws
void set_materials(const Context& context, const MaterialSource& source, TetMesh& mesh);

} // namespace gewebe
