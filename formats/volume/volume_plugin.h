#pragma once
// Volumes for programs that seldom need them: OpenVDB takes longer to load than a picture to draw
// or a net to make, so what needs it is a library of its own, gewebe-volume.so, that is loaded when
// a volume comes. It stands beside the program or in ../lib/gewebe from there, and stays loaded.

#include "base/context.h"
#include "base/mesh.h"
#include "shading/volume_view.h"
#include "tetrahedra/tet_mesh.h"

#include <string>

namespace gewebe {

/// volume_from_bytes (formats/volume/volume_file.h) and view_volume. \throw Error with place `name`
/// for what they throw, and if the library is missing or of another version
VolumeView view_volume_bytes(std::string bytes, const std::string& name,
                             const VolumeViewOptions& options, const Context& context);

/// How a surface is filled.
struct SurfaceFilling {
  double voxel = 1, cell = 2; ///< mm
  unsigned grade = 0;         ///< as in StuffingOptions
};

/// Tetrahedra that fill a closed surface: jones_density (voxelize/distance_ramp.h) by parity on
/// voxels at multiples of `voxel`, then stuff (stuffing/stuffing.h). \throw Error as they, with
/// place `name`, and as above
TetMesh fill_surface(const TriangleMesh& mesh, const std::string& name,
                     const SurfaceFilling& filling, const Context& context);

} // namespace gewebe
