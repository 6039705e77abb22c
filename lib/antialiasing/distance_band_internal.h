#pragma once
// Grey values in a band of voxels along a surface, from the nearest triangle of each voxel.
// Internal to the voxelizer.

#include "antialiasing/buried_faces_internal.h"
#include "antialiasing/coverage_internal.h"
#include "mesh/nearest_point.h"

#include <functional>

namespace gewebe::antialiasing {

/// Distance of voxel centre `p`, whose nearest triangle is `triangle`, from the surface; >= 0, in
/// voxels. Methods differ in this function.
using RampDistance =
    std::function<double(const SlabbedMesh& mesh, const Vec3& p, std::uint32_t triangle)>;

/// The same where the nearest point of the boundary lies on the curve in which two triangles pass
/// through each other.
using RampDistanceToCurve =
    std::function<double(const SlabbedMesh& mesh, const Vec3& p, const BoundaryPoint& nearest)>;

struct RampDistances {
  RampDistance to_triangle;
  RampDistanceToCurve to_curve;
};

/// Value ½ ∓ d/(2 half_width) in the band of voxels whose centre is nearer than half_width to the
/// surface, 0 or 1 elsewhere. `prepare` sees the mesh (index space moved by ½, holes closed if
/// requested) and gives the functions for d. By the winding rule voxels inside take the distance to
/// the boundary of the solid (nearest_boundary). \pre options.samples == 1
volume::Grid ramp_density(const Context& context, const TriangleMesh& mesh,
                          const volume::GridTransform& transform,
                          const voxelization::VoxelizeOptions& options, double half_width,
                          const std::function<RampDistances(const SlabbedMesh&)>& prepare,
                          CoverageReport& report);

} // namespace gewebe::antialiasing
