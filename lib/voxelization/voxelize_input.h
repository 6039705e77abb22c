#pragma once
// What all ways of voxelization ask of their input. Internal to the voxelizer.

#include "voxelization/voxelize.h"

#include <vector>

namespace gewebe::voxelization {

/// \throw Error if the mesh has no triangle, the lattice isn't cubic or its voxels are absurd
void check_voxelize_input(const TriangleMesh& mesh, const volume::GridTransform& transform);

/// Counts the boundary edges and holes of the mesh, whose points in index space and triangles are
/// given, and closes the holes where `on_open` says so. \throw Error, as scan_inside, if it is open
/// and to be refused
void close_or_refuse(const Context& context, const TriangleMesh& mesh,
                     const volume::GridTransform& transform, OpenMesh on_open,
                     std::vector<Vec3>& points, std::vector<Triangle>& triangles,
                     VoxelizeReport& report);

} // namespace gewebe::voxelization
