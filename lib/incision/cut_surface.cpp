#include "incision/cut_surface_internal.h"

#include <algorithm>
#include <cstddef>

namespace gewebe::incision {

std::uint32_t face_of(std::span<const TetSupport, 3> nodes) {
  std::uint32_t k = 0;
  while (k < 3 && std::ranges::any_of(nodes, [k](const TetSupport& node) { return node[k]; }))
    ++k;
  return k;
}

std::array<double, 3> weights_in_face(const std::array<Vec3, 3>& corners, const Vec3& place) {
  const auto& [a, b, c] = corners;
  if (place == a)
    return {1, 0, 0};
  const Vec3 normal = cross(b - a, c - a);
  const double whole = dot(normal, normal);
  const double at_b = dot(cross(place - a, c - a), normal) / whole,
               at_c = dot(cross(b - a, place - a), normal) / whole;
  return {1 - at_b - at_c, at_b, at_c};
}

} // namespace gewebe::incision
