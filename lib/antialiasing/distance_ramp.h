#pragma once
// Grey values of voxels from their distance to the surface, by the two published methods with which
// the report compares its own (FZKA 7190, section 5: [Jon96], [SK99]).
//
// Both give ½ at the surface and fall linearly from 1 to 0 across it, from -h inside to +h outside,
// h in voxels. The distance is computed in that band only. Elsewhere a voxel is 0 or 1 by the rule
// of inside and outside (VoxelRule), which gives the sign of the distance too. Unlike coverage.h,
// neither method keeps the volume at bent surfaces, thin walls or edges. But their values change
// evenly across the surface, so that gradients give accurate normals.
//
// By the winding rule the distance of a voxel inside is that to the boundary of the solid
// (buried_faces_internal.h): faces with the inside on both sides, where solids overlap or touch, do
// not count. By depth buffers it is that to all faces, and at faces inside values fall to ½, not
// below. Near a hole, where both rules close the solid without a face, voxels are 0 or 1. An open
// mesh is refused under parity alone.

#include "antialiasing/coverage.h"

namespace gewebe::antialiasing {

/// Half the width of Jones' ramp: two samples of an edge that the surface crosses lie within one
/// voxel of it, so both are on the ramp, and a plane is found again exactly by interpolation.
inline constexpr double jones_half_width = 1.0;
/// Half the width of the filter that Šrámek and Kaufman recommend for gradients by central
/// differences.
inline constexpr double sramek_half_width = 1.8;

/// Value ½ - d/(2h), d the signed Euclidean distance to the nearest triangle, h = jones_half_width;
/// round about edges and corners. `report.surface_voxels` counts the voxels of the band. \pre,
/// \throw as scan_inside
volume::Grid jones_density(const Context& context, const TriangleMesh& mesh,
                           const volume::GridTransform& transform, voxelization::OpenMesh on_open,
                           CoverageReport* report = nullptr,
                           voxelization::VoxelRule rule = voxelization::VoxelRule::parity);

/// The box filter of width 2h, h = sramek_half_width, laid along the surface's normal. For a plane
/// this is the ramp ½ - d/(2h). A polyhedron is made of planes by intersection (its edge is convex)
/// and union (concave), whose densities are the smaller and the larger one of both; so where the
/// nearest point lies on an edge or a corner, d is the largest distance to the planes of the faces
/// that meet there, and edges keep sharp. \pre, \throw as scan_inside
volume::Grid sramek_density(const Context& context, const TriangleMesh& mesh,
                            const volume::GridTransform& transform, voxelization::OpenMesh on_open,
                            CoverageReport* report = nullptr,
                            voxelization::VoxelRule rule = voxelization::VoxelRule::parity);

} // namespace gewebe::antialiasing
