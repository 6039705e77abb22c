#pragma once
// The parity rule on a mesh in index space. Internal to the voxelizer.

#include "voxelization/triangle_chunks_internal.h"
#include "voxelization/voxelize.h"

#include <functional>

namespace gewebe::voxelization {

/// Scans the mesh along k. `beside` is run once, on any thread, while the scan goes on. Adds to the
/// report's triangles_skipped, crossings, odd_rays and exact_tests.
InsideScan parity_scan(const Context& context, const SampleMesh& mesh, VoxelizeReport& report,
                       const std::function<void()>& beside);

} // namespace gewebe::voxelization
