#include "volume/crop.h"

#include "base/error.h"
#include "tests/unit/larger.h"
#include "tests/unit/surface_scenes.h"

#include <gtest/gtest.h>

#include <numbers>

namespace gewebe::test {
namespace {

using namespace scenes;

constexpr double pi = std::numbers::pi;

/// A ball about the origin whose density falls by 1 per mm at its surface, voxel `size`.
volume::Grid fraction_or_distance(double radius, double size, bool level_set = false) {
  volume::GridInfo info;
  info.transform = volume::uniform_transform(size);
  info.level_set = level_set;
  info.background = level_set ? 3 : 0;
  const int reach = static_cast<int>(std::ceil((radius + 4) / size));
  return sample(info, {-reach, -reach, -reach}, {reach, reach, reach}, [&](int i, int j, int k) {
    const double r = size * std::sqrt(i * i + j * j + k * k);
    return level_set ? std::clamp(r - radius, -3.0, 3.0) : std::clamp(0.5 + radius - r, 0.0, 1.0);
  });
}

mesh::MeshReport meshed(const volume::Grid& grid) {
  const mesh::MeshReport report =
      mesh::examine_mesh(surface::snap({}, surface::marching_cubes({}, grid), {}).mesh);
  EXPECT_TRUE(is_sound(report) && report.outward());
  return report;
}

TEST(Crop, FacesOfTheBoxLieWhereItIs) {
  const double radius = 12.3;
  for (const bool level_set : {false, true})
    for (const double z : {-3.0, 0.4, 2.25, 2.999}) {
      const volume::Grid grid = volume::crop({}, fraction_or_distance(radius, 0.5, level_set),
                                             {{-99, -99, z}, {99, 99, 99}}, level_set ? 0 : 0.5);
      const TriangleMesh mesh = surface::marching_cubes({}, grid).mesh;
      const mesh::MeshReport report = meshed(grid);
      EXPECT_EQ(report.components, 1U);
      EXPECT_EQ(report.euler, 2);
      const double h = radius - z, cap = pi * h * h * (3 * radius - h) / 3;
      EXPECT_NEAR(report.volume / cap, 1, 0.004) << z;
      double lowest = 99;
      for (const Vec3& p : mesh.points)
        lowest = test::smaller(lowest, p.z);
      EXPECT_NEAR(lowest, z, 1e-3) << z; // 1/1000 voxel and float
    }
}

TEST(Crop, AFaceBeyondTheLastLeafLiesWhereItIs) {
  // A cube whose last voxels on each side are the last of their leaves: the voxels that give the
  // face its place are in no leaf.
  for (const bool tiles : {false, true}) {
    const volume::Grid cube = scenes::sample(
        {}, {0, 0, 0}, {15, 15, 15}, [](int, int, int) { return 1.0; }, tiles);
    ASSERT_EQ(cube.leaves().size(), tiles ? 0U : 8U);
    for (int side = 0; side < 6; ++side)
      for (const double by : {0.2, 0.7}) {
        Box3 box{{-99, -99, -99}, {99, 99, 99}};
        (side < 3 ? box.min : box.max)[side % 3] = side < 3 ? -by : 15 + by;
        Box3 expected{{-0.5, -0.5, -0.5}, {15.5, 15.5, 15.5}}; // half a voxel beyond the centres
        (side < 3 ? expected.min : expected.max)[side % 3] = side < 3 ? -by : 15 + by;
        const Box3 found =
            bounding_box(surface::marching_cubes({}, volume::crop({}, cube, box, 0.5)).mesh);
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_NEAR(found.min[axis], expected.min[axis], 1e-3) << side << ' ' << by;
          EXPECT_NEAR(found.max[axis], expected.max[axis], 1e-3) << side << ' ' << by;
        }
      }
  }
}

TEST(Crop, WithinTheBoxNothingChanges) {
  const volume::Grid grid = metaballs(40, 3, 0.7);
  const Box3 box{{5.1, 6.2, 4.3}, {21, 19.7, 22.2}};
  const volume::Grid part = volume::crop({}, grid, box, 0.5);
  volume::GridAccessor before(grid), after(part);
  std::size_t inside = 0, wrong = 0, beyond = 0;
  for (int i = -2; i < 44; ++i)
    for (int j = -2; j < 44; ++j)
      for (int k = -2; k < 44; ++k) {
        const Vec3 p = grid.info().transform.to_world(
            {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
        const bool in = p.x >= box.min.x && p.y >= box.min.y && p.z >= box.min.z &&
                        p.x <= box.max.x && p.y <= box.max.y && p.z <= box.max.z;
        inside += in ? 1U : 0U;
        wrong += in && before.value({i, j, k}) != after.value({i, j, k}) ? 1U : 0U;
        beyond += !in && after.value({i, j, k}) > 0.5F ? 1U : 0U;
      }
  EXPECT_GT(inside, 5000U);
  EXPECT_EQ(wrong, 0U);
  EXPECT_EQ(beyond, 0U);
  meshed(part);
}

TEST(Crop, ABoxInsideTheBodyIsTheBox) {
  // The body is one large tile.
  volume::GridBuilder builder({});
  builder.add_tile({{0, 0, 0}, 128, 1, true});
  const Box3 box{{10.3, 20.6, 30.5}, {90.1, 80.2, 70.9}};
  const volume::Grid part = volume::crop({}, builder.finish(), box, 0.5);
  EXPECT_FALSE(part.tiles().empty());
  const mesh::MeshReport report = meshed(part);
  EXPECT_EQ(report.components, 1U);
  const double volume = 79.8 * 59.6 * 40.4;
  EXPECT_NEAR(report.volume / volume, 1, 1e-3); // the bevelled edges
}

TEST(Crop, TurnedLattice) {
  volume::GridInfo info;
  info.transform.m = {0.36, -0.48, 0, 1, 0.48, 0.36, 0, 2, 0, 0, 0.6, 3};
  const volume::Grid grid = sample(info, {-24, -24, -24}, {24, 24, 24}, [](int i, int j, int k) {
    return std::clamp(0.5 + 20.2 - std::sqrt(i * i + j * j + k * k), 0.0, 1.0);
  });
  const double radius = 20.2 * 0.6;
  const mesh::MeshReport report =
      meshed(volume::crop({}, grid, {{1, -99, -99}, {99, 99, 99}}, 0.5));
  EXPECT_NEAR(report.volume / (2 * pi / 3 * radius * radius * radius), 1, 0.05); // within a voxel
}

TEST(Crop, BoxesOutsideAndRound) {
  const volume::Grid grid = fraction_or_distance(9, 1);
  EXPECT_EQ(volume::crop({}, grid, {{50, 50, 50}, {60, 60, 60}}, 0.5).active_voxels(), 0U);
  EXPECT_EQ(volume::crop({}, grid, {{-50, -50, -50}, {60, 60, 60}}, 0.5).digest(), grid.digest());
}

TEST(Crop, SameForAnyThreadCount) {
  Context one, three;
  one.threads = 1;
  three.threads = 3;
  const Box3 box{{5, 5, 5}, {30, 30, 30}};
  EXPECT_EQ(volume::crop(one, metaballs(48, 9), box, 0.5).digest(),
            volume::crop(three, metaballs(48, 9), box, 0.5).digest());
}

TEST(Crop, Refuses) {
  const volume::Grid grid = fraction_or_distance(9, 1);
  EXPECT_THROW(volume::crop({}, grid, {{0, 0, 0}, {-1, 1, 1}}, 0.5), Error);
  EXPECT_THROW(volume::crop({}, grid, {{0, 0, 0}, {1, 1, 1}}, -0.5), Error); // background is inside
}

} // namespace
} // namespace gewebe::test
