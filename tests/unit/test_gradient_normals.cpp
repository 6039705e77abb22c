#include "surface/gradient_normals.h"

#include "tests/unit/larger.h"
#include "tests/unit/surface_scenes.h"
#include "volume/field.h"

#include <gtest/gtest.h>

namespace gewebe::test {
namespace {

using namespace scenes;

TEST(Field, IsExactForLinearAndTrilinearFunctions) {
  volume::GridInfo info;
  info.transform.m = {0.3, 0.1, 0, 5, 0, -0.7, 0.2, 6, 0.1, 0, 0.5, 7}; // sheared, mirrored
  const Vec3 slope{1, -2, 0.5};
  const volume::Grid linear = sample(info, {-9, -9, -9}, {9, 9, 9}, [&](int i, int j, int k) {
    return 100 + dot(slope, info.transform.to_world({static_cast<double>(i), static_cast<double>(j),
                                                     static_cast<double>(k)}));
  });
  volume::Field field(linear);
  for (int n = 0; n < 200; ++n) {
    const Vec3 index{n * 0.037 - 4, 3 - n * 0.031, n * 0.023 - 2};
    EXPECT_NEAR(field.value(index), 100 + dot(slope, info.transform.to_world(index)), 1e-4);
    const Vec3 error = field.gradient(index) - slope;
    EXPECT_LT(norm(error), 1e-3) << n;
  }
  const volume::Grid product = sample(
      {}, {-5, -5, -5}, {5, 5, 5}, [](int i, int j, int k) { return i * j * k + 2 * i * k - j; });
  volume::Field trilinear(product);
  EXPECT_NEAR(trilinear.value({0.5, -1.25, 2.75}), 0.5 * -1.25 * 2.75 + 2 * 0.5 * 2.75 + 1.25,
              1e-6);
}

/// Largest angle, degrees, between normals and the radial direction; ball about the origin.
double worst_angle(const TriangleMesh& mesh) {
  double worst = 0;
  for (std::size_t p = 0; p < mesh.points.size(); ++p) {
    const auto& n = mesh.normals[p];
    const Vec3 normal{static_cast<double>(n[0]), static_cast<double>(n[1]),
                      static_cast<double>(n[2])};
    EXPECT_NEAR(norm(normal), 1, 1e-6);
    const double cosine = dot(normal, mesh.points[p]) / norm(mesh.points[p]);
    const double angle = std::acos(std::min(1.0, cosine)) * 57.29577951308232;
    worst = test::larger(worst, angle);
  }
  return worst;
}

TEST(GradientNormals, OfABall) {
  volume::GridInfo mirrored;
  mirrored.transform.m = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1.5, 0};
  volume::GridInfo level_set;
  level_set.level_set = true;
  level_set.background = 4;
  for (const volume::GridInfo& info : {volume::GridInfo{}, mirrored, level_set}) {
    const volume::Grid grid = sample(info, {-20, -20, -20}, {20, 20, 20}, [&](int i, int j, int k) {
      const double r = norm(info.transform.to_world(
          {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)}));
      return info.level_set ? std::clamp(r - 13.2, -4.0, 4.0)
                            : std::clamp(0.5 + (13.2 - r) / 8, 0.0, 1.0);
    });
    for (const double epsilon : {0.0, 0.5}) {
      TriangleMesh mesh = surface::snap({}, surface::marching_cubes({}, grid), {epsilon}).mesh;
      EXPECT_EQ(surface::gradient_normals({}, grid, mesh).from_faces, 0U);
      check_mesh(mesh);
      EXPECT_LT(worst_angle(mesh), 1.5);
    }
  }
}

TEST(GradientNormals, BetweenSheetsComeFromTheFaces) {
  // Two sheets of one voxel with one between them: there the differences reach across and are 0.
  const volume::Grid grid = sample({}, {0, 0, 0}, {9, 9, 9},
                                   [](int, int, int k) { return k == 3 || k == 5 ? 1.0 : 0.0; });
  TriangleMesh mesh = surface::snap({}, surface::marching_cubes({}, grid), {}).mesh;
  EXPECT_GT(surface::gradient_normals({}, grid, mesh).from_faces, 50U);
  check_mesh(mesh);
  for (std::size_t p = 0; p < mesh.points.size(); ++p)
    if (const Vec3& place = mesh.points[p];
        place.x > 2 && place.x < 7 && place.y > 2 && place.y < 7) {
      const double z = place.z < 4 ? place.z - 3 : place.z - 5;
      EXPECT_NEAR(mesh.normals[p][2], z < 0 ? -1 : 1, 1e-6);
    }
}

TEST(GradientNormals, SameForAnyThreadCount) {
  const volume::Grid grid = metaballs(40, 2);
  TriangleMesh a = surface::marching_cubes({}, grid).mesh, b = a;
  Context one, three;
  one.threads = 1;
  three.threads = 3;
  surface::gradient_normals(one, grid, a);
  surface::gradient_normals(three, grid, b);
  EXPECT_EQ(a.normals, b.normals);
}

} // namespace
} // namespace gewebe::test
