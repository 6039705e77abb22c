#include "volume/resample.h"

#include "base/error.h"
#include "tests/unit/larger.h"
#include "tests/unit/surface_scenes.h"

#include <gtest/gtest.h>

#include <numbers>

namespace gewebe::test {
namespace {

using namespace scenes;

volume::GridTransform scaled(double x, double y, double z, const Vec3& origin) {
  volume::GridTransform transform;
  transform.m = {x, 0, 0, origin.x, 0, y, 0, origin.y, 0, 0, z, origin.z};
  return transform;
}

TEST(Resample, OntoTheSameLatticeIsExact) {
  const volume::Grid grid = noise(20, 1);
  EXPECT_EQ(volume::resample({}, grid, grid.info().transform).digest(), grid.digest());
  const volume::Grid balls = metaballs(40, 1, 0.3); // 0.3 is no binary fraction
  EXPECT_EQ(volume::resample({}, balls, balls.info().transform).digest(), balls.digest());
}

TEST(Resample, ShiftByWholeVoxelsIsExact) {
  const volume::Grid grid = metaballs(30, 2, 0.3);
  const volume::Grid shifted =
      volume::resample({}, grid, scaled(0.3, 0.3, 0.3, {0.3 * 5, -0.3 * 11, 0.3 * 8}));
  volume::GridAccessor a(grid), b(shifted);
  int differences = 0;
  for (int i = -20; i < 40; ++i)
    for (int j = -20; j < 50; ++j)
      for (int k = -20; k < 40; ++k)
        differences += a.value({i, j, k}) != b.value({i - 5, j + 11, k - 8}) ? 1 : 0;
  EXPECT_EQ(differences, 0);
  EXPECT_EQ(grid.active_voxels(), shifted.active_voxels());
}

/// A linear function on a box far larger than the probe region.
volume::Grid linear(const volume::GridTransform& transform) {
  volume::GridInfo info;
  info.transform = transform;
  return sample(info, {-30, -30, -30}, {30, 30, 30}, [&](int i, int j, int k) {
    const Vec3 p = transform.to_world(
        {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
    return 50 + p.x - 2 * p.y + 0.5 * p.z;
  });
}

TEST(Resample, ReproducesLinearFunctions) {
  // Trilinear and tent on a uniform lattice both do, the tent at whole ratios exactly.
  volume::GridTransform rotated;
  rotated.m = {0.36, -0.48, 0, 0.1, 0.48, 0.36, 0, 0.2, 0, 0, 0.6, 0.3};
  for (const volume::GridTransform& target :
       {scaled(0.4, 0.4, 0.4, {0.1, 0, 0}), scaled(2, 2, 2, {}), rotated,
        scaled(-0.7, 0.5, 0.9, {0, 0.3, 0})}) {
    const volume::Grid grid = volume::resample({}, linear(scaled(1, 1, 1, {0.25, 0, 0})), target);
    volume::GridAccessor values(grid);
    for (int n = 0; n < 500; ++n) {
      const Int3 index{n % 8 - 4, n / 8 % 8 - 4, n / 64 - 4};
      const Vec3 p = target.to_world({static_cast<double>(index[0]), static_cast<double>(index[1]),
                                      static_cast<double>(index[2])});
      const double error = std::abs(values.value(index) - (50 + p.x - 2 * p.y + 0.5 * p.z));
      // At whole ratios the tent is symmetric about old centres; a shift of 0.25 costs a little.
      EXPECT_LT(error, target.m[0] == 2 ? 0.05 : 1e-4);
    }
  }
}

TEST(Resample, PrefilterKeepsTheMeanOfNoise) {
  // White noise at three times the spacing: the tent averages, point sampling would not.
  const volume::Grid grid = noise(48, 5);
  const volume::Grid coarse = volume::resample({}, grid, volume::uniform_transform(3));
  double mean = 0, square = 0, count = 0;
  for (const volume::LeafView& leaf : coarse.leaves())
    for (int n = 0; n < volume::leaf_voxels; ++n) {
      const Int3 p{leaf.origin[0] + (n >> 6), leaf.origin[1] + (n >> 3 & 7),
                   leaf.origin[2] + (n & 7)};
      if (std::ranges::all_of(p, [](int i) { return i >= 4 && i <= 11; })) {
        mean += leaf.values[n];
        square += leaf.values[n] * leaf.values[n];
        ++count;
      }
    }
  mean /= count;
  EXPECT_EQ(count, 512);
  EXPECT_NEAR(mean, 0.5, 0.01);
  EXPECT_LT(std::sqrt(square / count - mean * mean), 0.06); // 0.289 without prefilter
}

/// Sum of the values times the voxel's volume.
double mass(const volume::Grid& grid) {
  double sum = 0;
  for (const volume::LeafView& leaf : grid.leaves())
    for (int n = 0; n < volume::leaf_voxels; ++n)
      sum += static_cast<double>(leaf.values[n]);
  for (const volume::TileView& tile : grid.tiles())
    sum += static_cast<double>(tile.value) * tile.dim * tile.dim * tile.dim;
  return sum * std::abs(grid.info().transform.determinant());
}

TEST(Resample, AThinSheetKeepsItsMassWhereverItLies) {
  // One voxel thick, brought to three and more: point sampling loses it or makes it three thick.
  for (const double size : {2.0, 3.0, 3.7, 5.0}) {
    double min = HUGE_VAL, max = 0, min_points = HUGE_VAL, max_points = 0;
    for (int offset = 0; offset < 8; ++offset) {
      const volume::Grid sheet =
          sample({}, {-20, -20, offset}, {20, 20, offset}, [](int, int, int) { return 1.0; });
      const double kept =
          mass(volume::resample({}, sheet, volume::uniform_transform(size))) / mass(sheet);
      min = test::smaller(min, kept);
      max = test::larger(max, kept);
      // The negative control: the values at the new centres alone.
      volume::GridAccessor values(sheet);
      double points = 0;
      for (int k = -9; k < 9; ++k)
        points += static_cast<double>(values.value({0, 0, static_cast<int>(k * size)})) * size;
      min_points = test::smaller(min_points, points);
      max_points = test::larger(max_points, points);
    }
    // Exact at whole ratios; else the weights of a centre, divided by their sum, err a little.
    const double tolerance = size == std::floor(size) ? 1e-6 : 0.03;
    EXPECT_GT(min, 1 - tolerance) << size;
    EXPECT_LT(max, 1 + tolerance) << size;
    EXPECT_TRUE(min_points == 0 && max_points >= size) << size;
  }
}

TEST(Resample, AWallIsMeshedWhereverItLies) {
  // 2.4 voxels of 1 brought to voxels of 2: its value stays above 0.5 somewhere at any offset.
  for (int offset = 0; offset < 12; ++offset) {
    const double low = 3 + offset / 6.0, high = low + 2.4;
    const volume::Grid wall = sample({}, {-12, -12, 0}, {12, 12, 16}, [&](int, int, int k) {
      return std::clamp(std::min(k + 0.5, high) - std::max(k - 0.5, low), 0.0, 1.0);
    });
    const mesh::MeshReport report = mesh::examine_mesh(
        surface::marching_cubes({}, volume::resample({}, wall, volume::uniform_transform(2))).mesh);
    EXPECT_TRUE(is_sound(report) && report.outward());
    EXPECT_EQ(report.components, 1U) << offset;
    EXPECT_EQ(report.euler, 2) << offset;
  }
}

TEST(Resample, SphereKeepsItsVolume) {
  const double radius = 12.2, exact = 4.0 / 3 * std::numbers::pi * radius * radius * radius;
  const volume::Grid grid = sample({}, {-16, -16, -16}, {16, 16, 16}, [&](int i, int j, int k) {
    return std::clamp(0.5 + radius - std::sqrt(i * i + j * j + k * k), 0.0, 1.0);
  });
  for (const double size : {0.5, 0.77, 1.0, 1.3, 2.0}) {
    const volume::Grid other = volume::resample({}, grid, volume::uniform_transform(size));
    EXPECT_EQ(other.info().isovalue, grid.info().isovalue);
    const mesh::MeshReport report = mesh::examine_mesh(surface::marching_cubes({}, other).mesh);
    EXPECT_TRUE(is_sound(report) && report.outward());
    EXPECT_LT(std::abs(report.volume / exact - 1), 0.005 + 0.006 * size * size) << size;
  }
}

TEST(Resample, LevelSet) {
  volume::GridInfo info;
  info.level_set = true;
  info.background = 3;
  const volume::Grid grid = sample(info, {-16, -16, -16}, {16, 16, 16}, [](int i, int j, int k) {
    return std::clamp(std::sqrt(i * i + j * j + k * k) - 11.3, -3.0, 3.0);
  });
  const volume::Grid other = volume::resample({}, grid, volume::uniform_transform(0.8));
  EXPECT_TRUE(other.info().level_set);
  EXPECT_EQ(other.info().background, 3);
  const mesh::MeshReport report = mesh::examine_mesh(surface::marching_cubes({}, other).mesh);
  EXPECT_TRUE(is_sound(report) && report.outward());
  EXPECT_NEAR(report.volume / (4.0 / 3 * std::numbers::pi * 11.3 * 11.3 * 11.3), 1, 0.01);
}

TEST(Resample, TilesStayTiles) {
  volume::GridBuilder builder({});
  builder.add_tile({{0, 0, 0}, 128, 2, true});
  builder.add_tile({{128, 0, 0}, 8, 2, true});
  const volume::Grid grid = builder.finish();
  for (const double size : {0.5, 1.0, 3.0}) {
    const volume::Grid other = volume::resample({}, grid, volume::uniform_transform(size));
    EXPECT_EQ(
        volume::GridAccessor(other).value({static_cast<int>(64 / size), static_cast<int>(64 / size),
                                           static_cast<int>(64 / size)}),
        2);
    const mesh::MeshReport report =
        mesh::examine_mesh(surface::marching_cubes({}, other, 1.0).mesh);
    EXPECT_TRUE(is_sound(report) && report.outward());
    EXPECT_NEAR(report.volume / (128.0 * 128 * 128), 1, 0.001 + 0.0015 * size);
    if (size < 1) {
      EXPECT_TRUE(std::ranges::any_of(other.tiles(),
                                      [](const volume::TileView& t) { return t.dim == 128; }));
    }
  }
}

TEST(Resample, RotatedSourceOntoUniformLattice) {
  volume::GridInfo info;
  info.transform.m = {0.36, -0.48, 0, 10, 0.48, 0.36, 0, 20, 0, 0, 0.6, 30};
  const volume::Grid grid = sample(info, {-16, -16, -16}, {16, 16, 16}, [&](int i, int j, int k) {
    return std::clamp(0.5 + 12.2 - std::sqrt(i * i + j * j + k * k), 0.0, 1.0);
  });
  const volume::Grid other = volume::resample({}, grid, volume::uniform_transform(0.6));
  const mesh::MeshReport report = mesh::examine_mesh(surface::marching_cubes({}, other).mesh);
  EXPECT_TRUE(is_sound(report));
  EXPECT_NEAR(report.volume / (4.0 / 3 * std::numbers::pi * std::pow(12.2 * 0.6, 3)), 1, 0.01);
}

TEST(Resample, SameForAnyThreadCount) {
  Context one, three;
  one.threads = 1;
  three.threads = 3;
  const volume::Grid grid = metaballs(48, 9);
  EXPECT_EQ(volume::resample(one, grid, volume::uniform_transform(0.7)).digest(),
            volume::resample(three, grid, volume::uniform_transform(0.7)).digest());
}

TEST(Resample, RefusesWhatItCannotDo) {
  volume::GridInfo band;
  band.band_isovalue = 0.5;
  const auto one = [](const volume::GridInfo& info) {
    return sample(info, {0, 0, 0}, {0, 0, 0}, [](int, int, int) { return 1; });
  };
  EXPECT_THROW(volume::resample({}, one(band), volume::uniform_transform(1)), Error);
  EXPECT_THROW(volume::resample({}, one({}), volume::uniform_transform(1e-12)),
               Error); // indices beyond 2^30
  EXPECT_THROW(volume::resample({}, one({}), volume::uniform_transform(0)), Error);
  EXPECT_THROW(volume::resample({}, one({}), volume::uniform_transform(65)), Error);
  EXPECT_NO_THROW(volume::resample({}, one({}), volume::uniform_transform(64)));
  Context small;
  small.max_memory = 1 << 20;
  EXPECT_THROW(volume::resample(small, one({}), volume::uniform_transform(1e-3)), Error);
  EXPECT_EQ(volume::resample({}, volume::Grid(), volume::uniform_transform(2)).active_voxels(), 0U);
}

} // namespace
} // namespace gewebe::test
