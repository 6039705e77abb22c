#pragma once
// Grey values of voxelization: how much of each voxel is inside a mesh (the report's smoothing,
// FZKA 7190 section 4.1, figures 4-5 and 4-6, without its samples).
//
// A voxel is the cube of ±½ about its centre in index space. Inside is what the parity rule of
// voxelize.h calls inside. Points are taken to index space in double, once.

#include "volume/grid.h"
#include "voxelization/voxelize.h"

#include <cstdint>
#include <optional>

namespace gewebe::antialiasing {

/// What was summed. Volumes are sums in double before the values become float.
struct CoverageReport {
  voxelization::VoxelizeReport mesh; ///< of the mesh; rays and crossings of `line_coverage` alone
  std::uint64_t surface_voxels = 0;  ///< a piece of the surface lies in them
  std::uint64_t overlap_voxels = 0;  ///< of these, whose winding numbers leave [0, 1]: folded
  double volume = 0;                 ///< mm³: of the values
  double winding_volume = 0;         ///< mm³: of the winding numbers, the mesh's signed volume
};

/// The fraction of each voxel's volume that is inside, exact up to rounding (1e-12): each triangle
/// is clipped to voxels and the pieces are summed by the divergence theorem with the field (0, 0,
/// z), which carries the area of a piece on to the voxels above it. What is summed is the mean
/// winding number w of the voxel, of faces oriented as `orient_closed` does; the fraction is w
/// folded into [0, 1], |w - 2 round(w / 2)|, which is the parity rule wherever a voxel meets two
/// winding numbers only: 2 is outside again. So shells in shells are hollow whatever their
/// orientation, and solids that overlap leave their common part out. Only voxels in which faces cut
/// each other or the surface passes three winding numbers may be off.
///
/// Nothing, `report.mesh` filled, if the mesh has boundary edges (after `fill` it has none) or no
/// orientation (orient_closed). \pre, \throw as scan_inside, the open mesh that is to be refused
/// included
std::optional<volume::Grid> exact_coverage(const Context& context, const TriangleMesh& mesh,
                                           const volume::GridTransform& transform,
                                           voxelization::OpenMesh on_open,
                                           CoverageReport* report = nullptr);

/// The mean over rays² rays along k, spread evenly over each voxel, of the length inside, exact
/// along each ray. Rays with an odd number of crossings count as outside. Error of a voxel:
/// O(1/rays) of the area in it that is steep to k. 1 <= rays <= 64. \pre, \throw as scan_inside
volume::Grid line_coverage(const Context& context, const TriangleMesh& mesh,
                           const volume::GridTransform& transform, int rays,
                           voxelization::OpenMesh on_open, CoverageReport* report = nullptr);

/// Bytes that either will need at most for meshes of ordinary shape.
double coverage_bytes(const TriangleMesh& mesh, const volume::GridTransform& transform);

} // namespace gewebe::antialiasing
