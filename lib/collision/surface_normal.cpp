#include "collision/surface_normal.h"

#include <cmath>
#include <cstddef>

namespace gewebe::collision {

namespace {

double eighth_power(double a) {
  const double square = a * a, fourth = square * square;
  return fourth * fourth;
}

} // namespace

SurfaceNormal surface_normal(const CollisionSurface& surface, std::span<const Vec3> x,
                             std::span<const std::uint32_t> vertices,
                             std::span<const double> weights, const Vec3& direction) {
  Vec3 normal;
  double flat = 0, whole = 0;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    Vec3 sum, facing;
    double area = 0;
    for (const std::uint32_t number : surface.triangles_of(vertices[k])) {
      const auto& [a, b, c] = surface.triangles[number];
      const Vec3 n = cross(x[b] - x[a], x[c] - x[a]);
      const double size = norm(n);
      if (!(size > 0))
        continue;
      const double along = dot(n, direction) / size;
      sum += n;
      area += size;
      facing += (along < 0 ? -1 : 1) * eighth_power(along) * n;
    }
    const double size = norm(facing), weight = std::abs(weights[k]);
    if (!(size > 0))
      return {};
    normal += weight / size * facing;
    flat += weight * norm(sum) / area;
    whole += weight;
  }
  const double size = norm(normal);
  if (!(size > 0))
    return {};
  return {normal / size, flat / whole};
}

} // namespace gewebe::collision
