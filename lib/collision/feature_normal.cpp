#include "collision/feature_normal.h"

#include <algorithm>

namespace gewebe::collision {

namespace {

double eighth_power(double a) {
  const double square = a * a, fourth = square * square;
  return fourth * fourth;
}

} // namespace

FeatureNormal feature_normal(const CollisionSurface& surface, std::span<const Vec3> x,
                             std::span<const std::uint32_t> feature, const Vec3& direction) {
  Vec3 sum, facing;
  double area = 0;
  for (const std::uint32_t k : surface.triangles_of(feature.front())) {
    const auto& triangle = surface.triangles[k];
    if (std::ranges::find(triangle, feature.back()) == triangle.end())
      continue;
    const auto& [a, b, c] = triangle;
    const Vec3 n = cross(x[b] - x[a], x[c] - x[a]);
    const double size = norm(n);
    if (!(size > 0))
      continue;
    const double along = dot(n, direction) / size;
    sum += n;
    area += size;
    facing += (along < 0 ? -1 : 1) * eighth_power(along) * n;
  }
  const double size = norm(facing);
  if (!(size > 0))
    return {};
  return {facing / size, norm(sum) / area};
}

} // namespace gewebe::collision
