#include "antialiasing/distance_ramp.h"
// Based on: M. Šrámek, A. E. Kaufman, Alias-Free Voxelization of Geometric Objects, IEEE
// Transactions on Visualization and Computer Graphics 5(3), 1999: the oriented box filter, its
// width, and solids put together from densities by minimum and maximum.

#include "antialiasing/distance_band_internal.h"
#include "mesh/border.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <span>

namespace gewebe::antialiasing {
namespace {

/// Unit normals, and the triangles round each point (points of equal position count as one).
struct Surroundings {
  std::vector<Vec3> normals; ///< zero for a triangle without area
  std::vector<std::uint32_t> point;
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> triangles;

  explicit Surroundings(const SlabbedMesh& mesh) : point(mesh::first_at_position(mesh.points)) {
    for (const Triangle& t : mesh.triangles) {
      const Vec3& a = mesh.points[t[0]];
      const Vec3 n = cross(mesh.points[t[1]] - a, mesh.points[t[2]] - a);
      const double length = norm(n);
      normals.push_back(length > 0 ? n / length : Vec3{});
    }
    first.assign(mesh.points.size() + 1, 0);
    for (const Triangle& t : mesh.triangles)
      for (const std::uint32_t corner : t)
        ++first[point[corner] + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    triangles.resize(first.back());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t n = 0; n < mesh.triangles.size(); ++n)
      for (const std::uint32_t corner : mesh.triangles[n])
        triangles[next[point[corner]]++] = n;
  }
  std::span<const std::uint32_t> around(std::uint32_t corner) const {
    const std::uint32_t p = point[corner];
    return std::span(triangles).subspan(first[p], first[p + 1] - first[p]);
  }
  bool touches(const Triangle& t, std::uint32_t corner) const {
    return std::ranges::any_of(t, [&](std::uint32_t c) { return point[c] == point[corner]; });
  }
};

double oriented_distance(const Surroundings& s, const SlabbedMesh& mesh, const Vec3& p,
                         std::uint32_t triangle) {
  const Triangle& t = mesh.triangles[triangle];
  const mesh::NearestPoint nearest =
      mesh::nearest_on_triangle(p, mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]);
  const Vec3 offset = p - nearest.point;
  if (nearest.feature == 0)
    return norm(offset);
  const bool on_edge = nearest.feature <= 3;
  const auto c = static_cast<std::size_t>(on_edge ? nearest.feature - 1 : nearest.feature - 4);
  double largest = -1;
  for (const std::uint32_t n : s.around(t[c]))
    if (s.normals[n] != Vec3{} && (!on_edge || s.touches(mesh.triangles[n], t[c == 2 ? 0 : c + 1])))
      largest = std::fmax(largest, std::fabs(dot(offset, s.normals[n])));
  return largest < 0 ? norm(offset) : largest; // no face there has an area
}

} // namespace

volume::Grid sramek_density(const Context& context, const TriangleMesh& mesh,
                            const volume::GridTransform& transform, voxelization::OpenMesh on_open,
                            CoverageReport* report, voxelization::VoxelRule rule) {
  CoverageReport local;
  const auto oriented = [](const SlabbedMesh& m) -> RampDistances {
    const auto around = std::make_shared<const Surroundings>(m);
    return {[around](const SlabbedMesh& same, const Vec3& p, std::uint32_t triangle) {
              return oriented_distance(*around, same, p, triangle);
            },
            [around](const SlabbedMesh&, const Vec3& p, const BoundaryPoint& nearest) {
              const Vec3 offset = p - nearest.point;
              return std::fmax(std::fabs(dot(offset, around->normals[nearest.triangle])),
                               std::fabs(dot(offset, around->normals[nearest.other])));
            }};
  };
  return ramp_density(context, mesh, transform, {rule, 1, on_open}, sramek_half_width, oriented,
                      report != nullptr ? *report : local);
}

} // namespace gewebe::antialiasing
