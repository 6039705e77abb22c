#include "shading/occlusion.h"

#include "base/parallel.h"
#include "shading/angles.h"
#include "shading/facet_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

namespace gewebe::shading {
namespace {

/// Around +z, distributed as the cosine.
std::array<Vec3, occlusion_rays> directions() {
  constexpr double golden_angle = 137.50776405003785;
  std::array<Vec3, occlusion_rays> all;
  for (std::size_t n = 0; n < all.size(); ++n) {
    const double square = (static_cast<double>(n) + 0.5) / occlusion_rays;
    const double r = std::sqrt(square);
    const auto [c, s] = cos_sin(golden_angle * static_cast<double>(n));
    all[n] = {r * c, r * s, std::sqrt(1 - square)};
  }
  return all;
}

/// Two unit vectors across n (Duff et al., Building an Orthonormal Basis, Revisited, 2017).
std::pair<Vec3, Vec3> across(const Vec3& n) {
  const double sign = n.z < 0 ? -1 : 1, a = -1 / (sign + n.z), b = n.x * n.y * a;
  return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}};
}

std::vector<bool> used_points(const Occluder& surface) {
  std::vector<bool> used(surface.points.size());
  for (const Triangle& t : surface.triangles)
    for (const std::uint32_t corner : t)
      used[corner] = true;
  return used;
}

} // namespace

std::vector<std::vector<float>> openness(std::span<const Occluder> surfaces, double radius,
                                         const Context& context) {
  std::vector<std::vector<float>> result;
  std::vector<FacetCorners> facets;
  for (const Occluder& surface : surfaces) {
    result.emplace_back(surface.points.size(), 1.0F);
    for (const auto& [a, b, c] : surface.triangles)
      facets.push_back({surface.points[a], surface.points[b], surface.points[c]});
  }
  if (!(radius > 0))
    return result;
  const FacetTree tree = facet_tree(facets);
  const FirstHit distance = first_hit(context.cpu);
  const std::array<Vec3, occlusion_rays> rays = directions();
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const Occluder& surface = surfaces[s];
    const std::vector<bool> used = used_points(surface);
    parallel_blocks(context, surface.points.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t p = begin; p < end; ++p) {
        const Vec3& n = surface.normals[p];
        if (!used[p] || n == Vec3{})
          continue;
        const auto [x, y] = across(n);
        const Vec3 from = surface.points[p] + n * (occlusion_lift * radius);
        double hidden = 0;
        for (const Vec3& ray : rays) {
          const Vec3 along = x * ray.x + y * ray.y + n * ray.z;
          hidden += 1 - distance(tree, from, along, radius) / radius;
        }
        result[s][p] = static_cast<float>(1 - hidden / occlusion_rays);
      }
    });
  }
  return result;
}

double occlusion_bytes(double triangles) {
  return triangles * sizeof(FacetCorners) + facet_tree_bytes(triangles);
}

} // namespace gewebe::shading
