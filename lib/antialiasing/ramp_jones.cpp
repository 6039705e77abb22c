#include "antialiasing/distance_ramp.h"
// Based on: M. W. Jones, The Production of Volume Data from Triangular Meshes Using Voxelisation,
// Computer Graphics Forum 15(5), 1996.

#include "antialiasing/distance_band_internal.h"

namespace gewebe::antialiasing {

volume::Grid jones_density(const Context& context, const TriangleMesh& mesh,
                           const volume::GridTransform& transform, voxelization::OpenMesh on_open,
                           CoverageReport* report, voxelization::VoxelRule rule) {
  CoverageReport local;
  const auto euclidean = [](const SlabbedMesh&) -> RampDistances {
    return {
        [](const SlabbedMesh& m, const Vec3& p, std::uint32_t triangle) {
          const Triangle& t = m.triangles[triangle];
          return norm(
              p -
              mesh::nearest_on_triangle(p, m.points[t[0]], m.points[t[1]], m.points[t[2]]).point);
        },
        [](const SlabbedMesh&, const Vec3& p, const BoundaryPoint& nearest) {
          return norm(p - nearest.point);
        }};
  };
  return ramp_density(context, mesh, transform, {rule, 1, on_open}, jones_half_width, euclidean,
                      report != nullptr ? *report : local);
}

} // namespace gewebe::antialiasing
