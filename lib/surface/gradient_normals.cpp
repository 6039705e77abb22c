#include "surface/gradient_normals.h"

#include "base/parallel.h"
#include "volume/field.h"

#include <array>
#include <cstddef>
#include <vector>

namespace gewebe::surface {

GradientNormalsReport gradient_normals(const Context& context, const volume::Grid& grid,
                                       TriangleMesh& mesh) {
  const std::size_t points = mesh.points.size();
  require_memory(context, static_cast<double>(points) * (sizeof(Vec3) + 3 * sizeof(float) + 1),
                 "the normals");
  std::vector<Vec3> area(points);
  for (const Triangle& t : mesh.triangles) {
    const Vec3& a = mesh.points[t[0]];
    const Vec3 normal = cross(mesh.points[t[1]] - a, mesh.points[t[2]] - a);
    for (const std::uint32_t p : t)
      area[p] += normal;
  }
  mesh.normals.resize(points);
  std::vector<std::uint8_t> from_faces(points, 0);
  const volume::GridTransform& transform = grid.info().transform;
  const double sign = grid.info().level_set ? 1 : -1;
  parallel_blocks(context, points, 4096, [&](std::size_t begin, std::size_t end) {
    volume::Field field(grid);
    for (std::size_t p = begin; p < end; ++p) {
      Vec3 normal = field.gradient(transform.to_index(mesh.points[p])) * sign;
      if (!(dot(normal, area[p]) > 0)) {
        normal = area[p];
        from_faces[p] = 1;
      }
      const double length = norm(normal);
      normal = length > 0 ? normal / length : Vec3{0, 0, 1};
      mesh.normals[p] = {static_cast<float>(normal.x), static_cast<float>(normal.y),
                         static_cast<float>(normal.z)};
    }
  });
  GradientNormalsReport report;
  for (const std::uint8_t faces : from_faces)
    report.from_faces += faces;
  return report;
}

} // namespace gewebe::surface
