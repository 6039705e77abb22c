// Density: against the expanded polynomial in long double, at the right places.

#include "base/error.h"
#include "density/density.h"
#include "density/density_kernel_internal.h"
#include "tests/unit/density_stress.h"
#include "tests/unit/larger.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

using namespace gewebe;
using test::random_particles;

namespace {

/// The same polynomial as the report writes it, in long double.
long double reference(const Particles& particles, const Vec3& x) {
  long double sum = 0;
  for (const Particle& p : particles) {
    const long double dx = static_cast<long double>(x.x) - static_cast<long double>(p.center.x);
    const long double dy = static_cast<long double>(x.y) - static_cast<long double>(p.center.y);
    const long double dz = static_cast<long double>(x.z) - static_cast<long double>(p.center.z);
    const auto R = static_cast<long double>(p.support_radius);
    const long double t = (dx * dx + dy * dy + dz * dz) / (R * R);
    if (t < 1)
      sum += static_cast<long double>(p.weight) *
             (1 - 22.0L / 9 * t + 17.0L / 9 * t * t - 4.0L / 9 * t * t * t);
  }
  return sum;
}

/// Largest |grid − reference| over a box of centres around all supports, evaluated at centre +
/// shift.
double largest_error(const volume::Grid& grid, const Particles& particles, double shift) {
  volume::GridAccessor accessor(grid);
  const volume::GridTransform& transform = grid.info().transform;
  const Box3 box = support_box(particles);
  const Vec3 low = transform.to_index(box.min);
  const Vec3 high = transform.to_index(box.max);
  double error = 0;
  for (auto i = static_cast<int>(low.x) - 2; i <= high.x + 2; ++i)
    for (auto j = static_cast<int>(low.y) - 2; j <= high.y + 2; ++j)
      for (auto k = static_cast<int>(low.z) - 2; k <= high.z + 2; ++k) {
        const Vec3 x = transform.to_world({i + shift, j + shift, k + shift});
        const auto value = static_cast<long double>(accessor.value({i, j, k}));
        error =
            test::larger(error, static_cast<double>(std::fabs(value - reference(particles, x))));
      }
  return error;
}

density::DensityOptions options_for(double voxel) {
  density::DensityOptions options;
  options.info.transform = volume::uniform_transform(voxel);
  return options;
}

std::vector<density::DensityKernel> density_add_kernels() {
  std::vector<density::DensityKernel> kernels{density::add_density_baseline};
  if (best_cpu_level() >= CpuLevel::avx2)
    kernels.push_back(density::add_density_avx2);
  if (best_cpu_level() >= CpuLevel::avx512)
    kernels.push_back(density::add_density_avx512);
  return kernels;
}

} // namespace

TEST(Density, EqualsTheExpandedPolynomialAtVoxelCentres) {
  const Particles particles = random_particles(12, 6, 5, {}, 1);
  const volume::Grid grid = density::metaball_density({}, particles, options_for(0.7));
  EXPECT_LT(largest_error(grid, particles, 0), 4e-6);
}

TEST(Density, NegativeControlHalfAVoxelAsideIsWrong) {
  const Particles particles = random_particles(12, 6, 5, {}, 1);
  const volume::Grid grid = density::metaball_density({}, particles, options_for(0.7));
  EXPECT_GT(largest_error(grid, particles, 0.5), 1e-2);
}

TEST(Density, IsAccurateFarFromTheOrigin) {
  const Vec3 offset{1e6, -1e6, 1e6};
  const Particles particles = random_particles(6, 2, 1, offset, 2);
  const volume::Grid grid = density::metaball_density({}, particles, options_for(0.25));
  EXPECT_LT(largest_error(grid, particles, 0), 4e-6);
}

TEST(Density, KeepsItsSignNearTheSupportsEdge) {
  const Particles particles{{{0.1, 0.2, 0.3}, 4.0, 1}};
  const volume::Grid grid = density::metaball_density({}, particles, options_for(0.05));
  for (const volume::LeafView& leaf : grid.leaves())
    for (int n = 0; n < volume::leaf_voxels; ++n)
      ASSERT_GE(leaf.values[n], 0);
}

TEST(Density, OnlyLeavesInReachExist) {
  const Particles particles{{{0, 0, 0}, 3, 1}, {{1e5, 0, 0}, 3, 1}};
  density::DensityReport report;
  const volume::Grid grid = density::metaball_density({}, particles, options_for(1), &report);
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
    const volume::Grid grid = density::metaball_density({}, particles, options_for(voxel));
    double sum = 0;
    for (const volume::LeafView& leaf : grid.leaves())
      for (int n = 0; n < volume::leaf_voxels; ++n)
        sum += static_cast<double>(leaf.values[n]);
    const double error = std::fabs(sum * voxel * voxel * voxel / exact - 1);
    EXPECT_LT(error, 2e-3 * voxel * voxel);
    EXPECT_LE(error, last);
    last = std::fmax(error, 1e-7);
  }
}

TEST(Density, ClipKeepsExactlyTheCentresInside) {
  const Particles particles = random_particles(5, 5, 5, {}, 3);
  density::DensityOptions options = options_for(0.5);
  const volume::Grid whole = density::metaball_density({}, particles, options);
  options.clip = Box3{{-2.2, -3.1, 0}, {1.9, 4, 5}};
  const volume::Grid part = density::metaball_density({}, particles, options);
  volume::GridAccessor a(whole);
  volume::GridAccessor b(part);
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
  const std::uint64_t expected =
      density::metaball_density(one, particles, options_for(0.5)).digest();
  for (const int threads : {2, 3})
    for (const CpuLevel level : {CpuLevel::baseline, CpuLevel::avx2, CpuLevel::avx512}) {
      Context context;
      context.threads = threads;
      context.cpu = std::min(level, best_cpu_level());
      EXPECT_EQ(density::metaball_density(context, particles, options_for(0.5)).digest(), expected);
    }
  Particles moved = particles;
  moved[7].weight = 0.999; // the digest can tell
  EXPECT_NE(density::metaball_density(one, moved, options_for(0.5)).digest(), expected);
}

TEST(Density, RotatedLatticeSamplesTheSameField) {
  const Particles particles = random_particles(8, 5, 4, {}, 5);
  density::DensityOptions options;
  const double c = std::cos(0.4) * 0.6;
  const double s = std::sin(0.4) * 0.6;
  options.info.transform.m = {c, -s, 0, 1.5, s, c, 0, -2, 0, 0, 0.6, 0.25};
  const volume::Grid grid = density::metaball_density({}, particles, options);
  double error = 0;
  for (const volume::LeafView& leaf : grid.leaves())
    for (int n = 0; n < volume::leaf_voxels; ++n) {
      const Vec3 index{1.0 * (leaf.origin[0] + (n >> 6)), 1.0 * (leaf.origin[1] + (n >> 3 & 7)),
                       1.0 * (leaf.origin[2] + (n & 7))};
      const long double exact = reference(particles, options.info.transform.to_world(index));
      error = test::larger(
          error, static_cast<double>(std::fabs(static_cast<long double>(leaf.values[n]) - exact)));
    }
  EXPECT_LT(error, 4e-6);
}

TEST(Density, RefusesWhatItCannotHold) {
  const Particles particles{{{0, 0, 0}, 1000, 1}};
  Context context;
  context.max_memory = 1 << 20;
  EXPECT_THROW((void)density::metaball_density(context, particles, options_for(1)), Error);
  density::DensityOptions stretched = options_for(1);
  stretched.info.transform.m[0] = 2;
  EXPECT_THROW((void)density::metaball_density({}, particles, stretched), Error);
}

TEST(Density, StressStaysWithinItsErrorBounds) {
  for (const test::StressResult& result :
       {test::stress_offset(1e6, 0.2), test::stress_offset(1e3, 0.1), test::stress_scale(1e-9),
        test::stress_scale(1e-4), test::stress_scale(1e9), test::stress_mixed(30),
        test::stress_many(3000, 30, 100), test::stress_cancelling(10), test::stress_edge(40)}) {
    EXPECT_LE(result.error, result.allowed) << result.name;
    EXPECT_TRUE(result.never_negative) << result.name;
  }
}

TEST(Density, NegativeControlAbsoluteFloatsFailTheOffset) {
  // Coordinates rounded to float before the leaf's origin is subtracted.
  const double offset = 1e6;
  Particles particles = random_particles(8, 1, 0.5, {offset, -offset, offset}, 11);
  for (Particle& p : particles)
    p.support_radius = 1;
  Particles rounded = particles;
  for (Particle& p : rounded)
    for (int axis = 0; axis < 3; ++axis)
      p.center[axis] = static_cast<double>(static_cast<float>(p.center[axis]));
  const volume::Grid grid = test::density_grid(rounded, 0.2);
  EXPECT_GT(test::largest_leaf_error(grid, particles, 3), 1e-2);
}

TEST(Density, NegativeControlTheExpandedPolynomialGoesNegative) {
  int negative = 0;
  for (int n = 1; n < 1000; ++n) {
    const float t = 1 - 1e-7F * static_cast<float>(n) / 100;
    const float value = 1 - 22.0F / 9 * t + 17.0F / 9 * t * t - 4.0F / 9 * t * t * t;
    negative += value < 0 ? 1 : 0;
  }
  EXPECT_GT(negative, 0);
}

TEST(Density, EveryKernelGivesTheSameBits) {
  std::mt19937 random(12);
  for (const float R : {0.4F, 3.0F, 6.0F, 12.0F, 40.0F, 1000.0F}) {
    const float outside = R < 40 ? R : R / 8; // the largest reach all voxels
    std::uniform_real_distribution<float> place(-outside, 7 + outside), weight(-1, 2);
    std::vector<density::LeafParticle> particles(101); // more than a kernel takes at once
    for (density::LeafParticle& p : particles)
      p = {place(random), place(random), place(random), 1 / R, weight(random)};
    std::vector<float> expected(volume::leaf_voxels);
    density::add_density_baseline(particles.data(), particles.size(), expected.data());
    EXPECT_TRUE(std::ranges::any_of(expected, [](float v) { return v != 0; })) << R;
    for (const density::DensityKernel kernel : density_add_kernels()) {
      std::vector<float> values(volume::leaf_voxels);
      kernel(particles.data(), particles.size(), values.data());
      EXPECT_EQ(std::memcmp(values.data(), expected.data(), volume::leaf_voxels * sizeof(float)), 0)
          << R;
    }
  }
}

TEST(Density, ListsWithParticlesOutOfReachGiveTheSameBits) {
  const Particles particles = random_particles(70, 14, 5, {}, 6);
  std::vector<density::LeafParticle> all;
  std::vector<density::LeafParticle> near;
  for (const Particle& p : particles) {
    const density::LeafParticle local{
        static_cast<float>(p.center.x), static_cast<float>(p.center.y),
        static_cast<float>(p.center.z), static_cast<float>(1 / p.support_radius),
        static_cast<float>(p.weight)};
    all.push_back(local);
    double distance2 = 0;
    for (int axis = 0; axis < 3; ++axis)
      distance2 += std::pow(std::fmax(std::fmax(-p.center[axis], p.center[axis] - 7), 0), 2);
    if (distance2 < p.support_radius * p.support_radius * 1.001)
      near.push_back(local);
  }
  ASSERT_LT(near.size() + 20, all.size());
  std::vector<float> expected(volume::leaf_voxels);
  density::add_density_baseline(near.data(), near.size(), expected.data());
  for (const density::DensityKernel kernel : density_add_kernels())
    for (const auto* list : {&near, &all}) {
      std::vector<float> values(volume::leaf_voxels);
      kernel(list->data(), list->size(), values.data());
      EXPECT_EQ(std::memcmp(values.data(), expected.data(), volume::leaf_voxels * sizeof(float)),
                0);
    }
}

TEST(Density, PredictsBeforeTheWork) {
  const Particles particles = random_particles(40, 20, 4, {}, 7);
  density::DensityOptions options = options_for(0.4);
  density::DensityReport before;
  options.planned = [&](const density::DensityReport& plan) { before = plan; };
  density::DensityReport after;
  const volume::Grid grid = density::metaball_density({}, particles, options, &after);
  EXPECT_EQ(before.leaves, 0U);
  EXPECT_EQ(before.predicted_bytes, after.predicted_bytes);
  EXPECT_GE(before.predicted_voxels, 512.0 * static_cast<double>(grid.leaves().size()));
  EXPECT_LE(before.predicted_voxels, 540.0 * static_cast<double>(grid.leaves().size()));
  const auto bytes = static_cast<double>(grid.memory_bytes());
  EXPECT_GE(before.predicted_bytes, 0.98 * bytes);
  EXPECT_LE(before.predicted_bytes, 1.1 * bytes);
}
