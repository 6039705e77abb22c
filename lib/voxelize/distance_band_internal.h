#pragma once
// The nearest triangle of each voxel near a surface. Internal to the voxelizer.

#include "voxelize/coverage_internal.h"

#include <functional>

namespace gewebe {

/// Where on a triangle the point nearest to another lies.
struct NearestPoint {
  Vec3 point;
  /// 0: within the face; 1, 2, 3: on the edge from corner 0, 1, 2 to the next; 4, 5, 6: corner 0,
  /// 1,
  /// 2
  int feature = 0;
};

/// After C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
NearestPoint nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

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
