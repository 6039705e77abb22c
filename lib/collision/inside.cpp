#include "collision/inside.h"

#include <cmath>
#include <numbers>

namespace gewebe::collision {

double winding_number(std::span<const std::array<std::uint32_t, 3>> triangles,
                      std::span<const Vec3> x, const Vec3& p) {
  double sum = 0; // halves of solid angles
  for (const auto& [i, j, k] : triangles) {
    const Vec3 a = x[i] - p, b = x[j] - p, c = x[k] - p;
    const double la = norm(a), lb = norm(b), lc = norm(c);
    sum += std::atan2(dot(a, cross(b, c)),
                      la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

} // namespace gewebe::collision
