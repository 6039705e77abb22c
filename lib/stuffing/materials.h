#pragma once
// Where the materials of a solid come from: a tumour in its organ, the organs of a scan.

#include "base/context.h"
#include "labels/label_runs.h"
#include "stuffing/stuffing.h"
#include "tetrahedra/tet_mesh.h"
#include "volume/grid.h"

#include <cstdint>
#include <optional>

namespace gewebe::stuffing {

/// 1 inside `volume` (by its own isovalue or another one, interpolated trilinearly), else 0; what
/// it makes throws Error for a value that is not finite. \pre the volume outlives what is made of
/// it \throw Error if the transform is singular
MaterialSource inside_source(const volume::Grid& volume, std::optional<double> isovalue = {});

/// The label of the voxel that holds the place, 0 outside of the volume. A voxel reaches half the
/// way to its neighbours along the axes of its lattice, which may be oblique. Where that label is 0
/// and `reach` isn't: that of the nearest centre (in mm; of equal ones the first by k, j, i) with
/// another one, of the voxels up to `reach` away along each axis. Time grows with reach³.
///
/// \param solid  if given, 1 inside the solid, else 0. An unlabelled voxel whose centre lies in it,
/// and those of its six neighbours too, then has material 0 of its own, and competes with labels:
/// it is tissue without a label and not background that the smooth surface of labels cuts.
/// \pre the labels outlive what is made of them \throw Error if the transform is singular
MaterialSource label_source(const labels::LabelRuns& labels, std::int32_t reach = 0,
                            const MaterialSource& solid = {});

/// Gives each tetrahedron the material of its centroid, so that the interface between two materials
/// runs along faces of the mesh. \throw what the source throws
void set_materials(const Context& context, const MaterialSource& source, tetrahedra::TetMesh& mesh);

} // namespace gewebe::stuffing
