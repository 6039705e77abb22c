#pragma once
// The parity rule on a mesh in index space. Internal to the voxelizer.

#include "base/context.h"
#include "volume/voxelize.h"

#include <functional>
#include <span>

namespace gewebe {

/// A mesh in the index space of the samples: coordinates as exact_predicates.h wants them,
/// magnitudes below 2^30.
struct SampleMesh {
  int samples = 1; ///< along the edge of a voxel
  std::span<const Vec3> points;
  std::span<const Triangle> triangles;
  CpuLevel cpu = CpuLevel::baseline;
};

/// Scans the mesh along k. `beside` is run once, on any thread, while the scan goes on. Adds to the
/// report's triangles_skipped, crossings, odd_rays and exact_tests.
InsideScan parity_scan(const Context& context, const SampleMesh& mesh, VoxelizeReport& report,
                       const std::function<void()>& beside);

} // namespace gewebe
