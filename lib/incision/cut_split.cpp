#include "incision/cut_split_internal.h"

#include <cmath>

namespace gewebe::incision {

double sharpness(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 ab = b - a, ac = c - a, ad = d - a, bc = c - b, bd = d - b;
  constexpr double worst = 2;
  if (!(dot(cross(ab, ac), ad) > 0))
    return worst;
  const std::array<Vec3, 4> normal{cross(bc, bd), cross(ad, ac), cross(ab, ad), cross(ac, ab)};
  double largest = 0; // of cos²
  for (std::size_t m = 0; m < 4; ++m)
    for (std::size_t n = m + 1; n < 4; ++n) {
      const double product = dot(normal[m], normal[n]);
      const double square =
          product * product / (dot(normal[m], normal[m]) * dot(normal[n], normal[n]));
      if (!(square <= 1.5)) // NaN, too
        return worst;
      largest = square > largest ? square : largest;
    }
  return std::sqrt(largest);
}

} // namespace gewebe::incision
