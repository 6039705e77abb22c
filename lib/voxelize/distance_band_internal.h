#pragma once
// The nearest triangle of each voxel near a surface. Internal to the voxelizer.

#include "mesh/nearest_point.h"
#include "voxelize/coverage_internal.h"

#include <functional>

namespace gewebe {

/// Distance that the ramp takes for voxel centre `p` whose nearest triangle is `triangle`; >= 0, in
/// voxels.
using RampDistance =
    std::function<double(const SlabbedMesh& mesh, const Vec3& p, std::uint32_t triangle)>;

/// Value ½ ∓ d/(2 half_width) in the band of voxels whose centre is nearer than half_width to the
/// surface, 0 or 1 elsewhere. `prepare` sees the mesh (index space moved by ½, holes closed where
/// asked) and gives the function for d. \pre options.samples == 1
Grid ramp_density(const Context& context, const TriangleMesh& mesh, const GridTransform& transform,
                  const VoxelizeOptions& options, double half_width,
                  const std::function<RampDistance(const SlabbedMesh&)>& prepare,
                  CoverageReport& report);

} // namespace gewebe
