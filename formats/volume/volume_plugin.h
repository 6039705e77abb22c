#pragma once
// Volumes for programs that seldom need them: OpenVDB takes longer to load than a picture to draw
// or a net to make, so what needs it is a library of its own, gewebe-volume.so, that is loaded when
// a volume comes. It stands beside the program or in ../lib/gewebe from there, and stays loaded.

#include "base/context.h"
#include "geometry/mesh.h"
#include "shading/volume_view.h"
#include "tetrahedra/refinement.h"
#include "tetrahedra/tet_mesh.h"
#include "voxelization/voxelize.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gewebe::formats {

/// volume_from_bytes (formats/volume/volume_file.h) and view_volume. \throw Error with place `name`
/// for what they throw, and if the library is missing or of another version
shading::VolumeView view_volume_bytes(std::string bytes, const std::string& name,
                                      const shading::VolumeViewOptions& options,
                                      const Context& context);

/// How a surface is filled.
struct SurfaceFilling {
  double voxel = 1, cell = 2; ///< mm
  unsigned grade = 0;         ///< as in StuffingOptions
  /// Parts of the mesh that are bodies of their own, different ones. Each must have triangles.
  std::vector<std::int32_t> parts = {};
  voxelization::VoxelRule rule = voxelization::VoxelRule::parity;
  voxelization::OpenMesh on_open = voxelization::OpenMesh::refuse;
  std::vector<tetrahedra::RefinedRegion> refine =
      {}; ///< as in StuffingOptions; not with parts of their own
};

/// Tetrahedra that fill a surface: jones_density (antialiasing/distance_ramp.h) on voxels at
/// multiples of `voxel`, then stuff (stuffing/stuffing.h).
struct FilledSurface {
  /// Without parts of their own without materials; else a tetrahedron has as material the place in
  /// `parts` of that with the least volume of those that hold it, or their number. Faces follow the
  /// interfaces.
  tetrahedra::TetMesh mesh;
  /// Of each part of its own, then of all others together, if there are any: of its surface and of
  /// the tetrahedra in it, whatever their material, mm³. Without parts of their own: of all.
  struct Volume {
    double of_surface = 0, filled = 0;
  };
  std::vector<Volume> volumes;
  /// What was found in these bodies, in the same order: holes, faces that were turned.
  std::vector<voxelization::VoxelizeReport> found;
};
/// \throw Error as they, with place `name`, and as above; each part of its own, and the others
/// together, must be closed unless `rule` and `on_open` allow holes
FilledSurface fill_surface(const TriangleMesh& mesh, const std::string& name,
                           const SurfaceFilling& filling, const Context& context);

} // namespace gewebe::formats
