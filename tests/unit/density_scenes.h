#pragma once
// Particle scenes and their density in long double, for the tests of the density.

#include "geometry/particles.h"
#include "tests/unit/larger.h"
#include "volume/grid.h"

#include <cmath>
#include <random>

namespace gewebe::test {

/// The density at x from the factored polynomial, terms in long double.
inline long double exact_density(const Particles& particles, const Vec3& x) {
  long double sum = 0;
  for (const Particle& p : particles) {
    const long double dx = static_cast<long double>(x.x) - static_cast<long double>(p.center.x);
    const long double dy = static_cast<long double>(x.y) - static_cast<long double>(p.center.y);
    const long double dz = static_cast<long double>(x.z) - static_cast<long double>(p.center.z);
    const auto R = static_cast<long double>(p.support_radius);
    const long double t = (dx * dx + dy * dy + dz * dz) / (R * R);
    if (t < 1)
      sum += static_cast<long double>(p.weight) * (1 - t) * (1 - t) * (1 - 4 * t / 9);
  }
  return sum;
}

/// Particles in a cube of half side `spread` about `offset`, R from 0.2 to 2.2 times `radius`;
/// every fifth removes matter where `negative` is set.
inline Particles random_particles(int count, double spread, double radius, const Vec3& offset,
                                  unsigned seed, bool negative = true) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Particles particles;
  for (int n = 0; n < count; ++n) {
    const Vec3 center{unit(random), unit(random), unit(random)};
    particles.push_back({offset + center * spread, radius * (1.2 + unit(random)),
                         negative && n % 5 == 4 ? -0.7 : 1.0});
  }
  return particles;
}

/// Largest |grid − exact density| over every `stride`-th voxel of every leaf; NaN where a value is
/// NaN.
inline double largest_leaf_error(const volume::Grid& grid, const Particles& particles,
                                 int stride = 1) {
  const volume::GridTransform& transform = grid.info().transform;
  double error = 0;
  int phase = 0;
  for (const volume::LeafView& leaf : grid.leaves()) {
    phase = (phase + 7) % stride;
    for (int n = phase; n < volume::leaf_voxels; n += stride) {
      const Vec3 index{1.0 * (leaf.origin[0] + (n >> 6)), 1.0 * (leaf.origin[1] + (n >> 3 & 7)),
                       1.0 * (leaf.origin[2] + (n & 7))};
      const long double exact = exact_density(particles, transform.to_world(index));
      const auto here =
          static_cast<double>(std::fabs(static_cast<long double>(leaf.values[n]) - exact));
      error = numeric::larger(error, here);
    }
  }
  return error;
}

} // namespace gewebe::test
