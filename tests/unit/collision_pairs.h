#pragma once
// Random pairs of primitives for tests of distances and of continuous collision detection.

#include "geometry/exact_predicates.h"
#include "geometry/vec3.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

namespace gewebe::test {

inline Vec3 random_point(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> side(-size, size);
  const double x = side(random), y = side(random);
  return {x, y, side(random)};
}

/// Vertices of a pair: in general position, on a coarse lattice (coplanar, parallel, equal ones),
/// or nearly flat.
template <std::size_t n>
std::array<Vec3, n> random_pair(std::mt19937& random) {
  std::array<Vec3, n> x;
  const unsigned kind = random() % 4;
  for (Vec3& p : x) {
    p = random_point(random, 2);
    if (kind == 1)
      p = {std::round(p.x), std::round(p.y), std::round(p.z)};
    if (kind == 2)
      p.z *= 1e-6;
    if (kind == 3)
      p.y = std::round(p.y) + 1e-9 * p.z;
  }
  return x;
}

/// Whether the segment p q and the triangle have a point in common, exactly; false where the
/// segment lies in the plane.
inline bool passes(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c) {
  std::uint64_t tests = 0;
  const int sp = side_sign(a, b, c, p, tests), sq = side_sign(a, b, c, q, tests);
  if (sp * sq > 0 || (sp == 0 && sq == 0))
    return false;
  const int ab = side_sign(p, q, a, b, tests), bc = side_sign(p, q, b, c, tests),
            ca = side_sign(p, q, c, a, tests);
  return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

} // namespace gewebe::test
