// Density: against the expanded polynomial in long double, at the right places.

#include "base/error.h"
#include "volume/density.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace gewebe;

namespace {

long double expanded(long double r2, long double R2) {
  const long double t = r2 / R2;
  return t < 1 ? 1 - 22.0L / 9 * t + 17.0L / 9 * t * t - 4.0L / 9 * t * t * t : 0;
}

long double reference(const Particles& particles, const Vec3& x) {
  long double sum = 0;
  for (const Particle& p : particles) {
    const long double dx = static_cast<long double>(x.x) - static_cast<long double>(p.center.x);
    const long double dy = static_cast<long double>(x.y) - static_cast<long double>(p.center.y);
    const long double dz = static_cast<long double>(x.z) - static_cast<long double>(p.center.z);
    const auto R = static_cast<long double>(p.support_radius);
    sum += static_cast<long double>(p.weight) * expanded(dx * dx + dy * dy + dz * dz, R * R);
  }
  return sum;
}

Particles random_particles(int count, double spread, double radius, const Vec3& offset,
                           unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  Particles particles;
  for (int n = 0; n < count; ++n)
    particles.push_back({offset + Vec3{unit(random), unit(random), unit(random)} * spread,
                         radius * (1.2 + unit(random)), n % 5 == 4 ? -0.7 : 1.0});
  return particles;
}

/// Largest |grid − reference| over a box of centres around all supports, evaluated at centre +
/// shift.
double largest_error(const Grid& grid, const Particles& particles, double shift) {
  GridAccessor accessor(grid);
  const GridTransform& transform = grid.info().transform;
  const Box3 box = support_box(particles);
  const Vec3 low = transform.to_index(box.min);
  const Vec3 high = transform.to_index(box.max);
  double error = 0;
  for (auto i = static_cast<int>(low.x) - 2; i <= high.x + 2; ++i)
    for (auto j = static_cast<int>(low.y) - 2; j <= high.y + 2; ++j)
      for (auto k = static_cast<int>(low.z) - 2; k <= high.z + 2; ++k) {
        const Vec3 x = transform.to_world({i + shift, j + shift, k + shift});
        const auto value = static_cast<long double>(accessor.value({i, j, k}));
        error = std::fmax(error, static_cast<double>(std::fabs(value - reference(particles, x))));
      }
  return error;
}

DensityOptions options_for(double voxel) {
  DensityOptions options;
  options.info.transform = uniform_transform(voxel);
  return options;
}

} // namespace

TEST(Density, EqualsTheExpandedPolynomialAtVoxelCentres) {
  const Particles particles = random_particles(12, 6, 5, {}, 1);
  const Grid grid = metaball_density({}, particles, options_for(0.7));
  EXPECT_LT(largest_error(grid, particles, 0), 4e-6);
}

TEST(Density, NegativeControlHalfAVoxelAsideIsWrong) {
  const Particles particles = random_particles(12, 6, 5, {}, 1);
  const Grid grid = metaball_density({}, particles, options_for(0.7));
  EXPECT_GT(largest_error(grid, particles, 0.5), 1e-2);
}

TEST(Density, IsAccurateFarFromTheOrigin) {
  const Vec3 offset{1e6, -1e6, 1e6};
  const Particles particles = random_particles(6, 2, 1, offset, 2);
  const Grid grid = metaball_density({}, particles, options_for(0.25));
  EXPECT_LT(largest_error(grid, particles, 0), 4e-6);
}

TEST(Density, KeepsItsSignNearTheSupportsEdge) {
  const Particles particles{{{0.1, 0.2, 0.3}, 4.0, 1}};
  const Grid grid = metaball_density({}, particles, options_for(0.05));
  for (const LeafView& leaf : grid.leaves())
    for (int n = 0; n < leaf_voxels; ++n)
      ASSERT_GE(leaf.values[n], 0);
}

TEST(Density, OnlyLeavesInReachExist) {
  const Particles particles{{{0, 0, 0}, 3, 1}, {{1e5, 0, 0}, 3, 1}};
  DensityReport report;
  const Grid grid = metaball_density({}, particles, options_for(1), &report);
  EXPECT_LE(grid.leaves().size(), 16U);
  EXPECT_EQ(report.leaves, grid.leaves().size());
  EXPECT_EQ(report.particles_out_of_reach, 0U);
}

TEST(Density, IntegralOfOneParticleConverges) {
  // ∫ (1−t)²(1−4t/9) dV = 4π R³ ∫ (1−s²)²(1−4s²/9) s² ds over 0…1 = 4π R³ (8/105 − 4/9 · 8/315)
  const double pi = std::acos(-1.0);
  const double R = 5;
  const double exact = 4 * pi * R * R * R * (8.0 / 105 - 4.0 / 9 * 8.0 / 315);
  const Particles particles{{{0.05, 0.1, -0.13}, R, 1}};
  double last = HUGE_VAL;
  for (const double voxel : {1.0, 0.5, 0.25}) {
    const Grid grid = metaball_density({}, particles, options_for(voxel));
    double sum = 0;
    for (const LeafView& leaf : grid.leaves())
      for (int n = 0; n < leaf_voxels; ++n)
        sum += static_cast<double>(leaf.values[n]);
    const double error = std::fabs(sum * voxel * voxel * voxel / exact - 1);
    EXPECT_LT(error, 2e-3 * voxel * voxel);
    EXPECT_LE(error, last);
    last = std::fmax(error, 1e-7);
  }
}

TEST(Density, ClipKeepsExactlyTheCentresInside) {
  const Particles particles = random_particles(5, 5, 5, {}, 3);
  DensityOptions options = options_for(0.5);
  const Grid whole = metaball_density({}, particles, options);
  options.clip = Box3{{-2.2, -3.1, 0}, {1.9, 4, 5}};
  const Grid part = metaball_density({}, particles, options);
  GridAccessor a(whole);
  GridAccessor b(part);
  for (int i = -30; i < 30; ++i)
    for (int j = -30; j < 30; ++j)
      for (int k = -30; k < 30; ++k) {
        const Vec3 x = options.info.transform.to_world({1.0 * i, 1.0 * j, 1.0 * k});
        const bool inside =
            x.x >= -2.2 && x.x <= 1.9 && x.y >= -3.1 && x.y <= 4 && x.z >= 0 && x.z <= 5;
        ASSERT_EQ(b.value({i, j, k}), inside ? a.value({i, j, k}) : 0.0F);
      }
}

TEST(Density, SameBitsForAnyThreadCountAndCpuLevel) {
  const Particles particles = random_particles(300, 20, 3, {}, 4);
  Context one;
  one.threads = 1;
  const std::uint64_t expected = metaball_density(one, particles, options_for(0.5)).digest();
  for (const int threads : {2, 3})
    for (const CpuLevel level : {CpuLevel::baseline, best_cpu_level()}) {
      Context context;
      context.threads = threads;
      context.cpu = level;
      EXPECT_EQ(metaball_density(context, particles, options_for(0.5)).digest(), expected);
    }
  Particles moved = particles;
  moved[7].weight = 0.999; // the digest can tell
  EXPECT_NE(metaball_density(one, moved, options_for(0.5)).digest(), expected);
}

TEST(Density, RotatedLatticeSamplesTheSameField) {
  const Particles particles = random_particles(8, 5, 4, {}, 5);
  DensityOptions options;
  const double c = std::cos(0.4) * 0.6;
  const double s = std::sin(0.4) * 0.6;
  options.info.transform.m = {c, -s, 0, 1.5, s, c, 0, -2, 0, 0, 0.6, 0.25};
  const Grid grid = metaball_density({}, particles, options);
  double error = 0;
  for (const LeafView& leaf : grid.leaves())
    for (int n = 0; n < leaf_voxels; ++n) {
      const Vec3 index{1.0 * (leaf.origin[0] + (n >> 6)), 1.0 * (leaf.origin[1] + (n >> 3 & 7)),
                       1.0 * (leaf.origin[2] + (n & 7))};
      const long double exact = reference(particles, options.info.transform.to_world(index));
      error = std::fmax(
          error, static_cast<double>(std::fabs(static_cast<long double>(leaf.values[n]) - exact)));
    }
  EXPECT_LT(error, 4e-6);
}

TEST(Density, RefusesWhatItCannotHold) {
  const Particles particles{{{0, 0, 0}, 1000, 1}};
  Context context;
  context.max_memory = 1 << 20;
  EXPECT_THROW((void)metaball_density(context, particles, options_for(1)), Error);
  DensityOptions stretched = options_for(1);
  stretched.info.transform.m[0] = 2;
  EXPECT_THROW((void)metaball_density({}, particles, stretched), Error);
}
