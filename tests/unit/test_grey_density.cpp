// Densities of scans: the surface lies where the grey values meet the thresholds.

#include "base/error.h"
#include "labels/grey_density.h"
#include "mesh/check.h"
#include "surface/marching_cubes.h"
#include "tests/unit/larger.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

using namespace gewebe;

namespace {

/// A scan of `value` (of a place in the world) on a lattice of `spacing`, turned about z.
labels::GreyVolume scan_of(const Int3& size, const Vec3& spacing, double angle,
                           const std::function<double(const Vec3&)>& value) {
  labels::GreyVolume scan;
  scan.size = size;
  const double c = std::cos(angle), s = std::sin(angle);
  scan.transform.m = {
      c * spacing.x, -s * spacing.y, 0, -8, s * spacing.x, c * spacing.y, 0, 5, 0, 0, spacing.z, 3};
  for (std::int32_t k = 0; k < size[2]; ++k)
    for (std::int32_t j = 0; j < size[1]; ++j)
      for (std::int32_t i = 0; i < size[0]; ++i)
        scan.values.push_back(static_cast<float>(value(scan.transform.to_world(
            {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)}))));
  return scan;
}

Vec3 middle_of(const labels::GreyVolume& scan) {
  return scan.transform.to_world(
      {(scan.size[0] - 1) / 2.0, (scan.size[1] - 1) / 2.0, (scan.size[2] - 1) / 2.0});
}

labels::GreyDensityOptions above(double low) {
  labels::GreyDensityOptions options;
  options.low = low;
  return options;
}

std::string message(const labels::GreyVolume& scan, const labels::GreyDensityOptions& options) {
  try {
    (void)labels::grey_density({}, scan, options);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

double volume_of(const TriangleMesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles)
    sum += dot(mesh.points[t[0]], cross(mesh.points[t[1]], mesh.points[t[2]])) / 6;
  return sum;
}

} // namespace

// The planes of a linear field are found exactly, in voxels of any shape, at their edges and finer.
TEST(GreyDensity, PlanesAreExact) {
  const Vec3 slope{20, -7, 11};
  for (const Vec3& spacing : {Vec3{1, 1, 1}, Vec3{0.75, 0.75, 2.5}}) {
    for (const double finer : {1.0, 0.4}) {
      const labels::GreyVolume scan =
          scan_of({20, 18, 14}, spacing, 0.3, [&](const Vec3& p) { return dot(slope, p) - 40; });
      labels::GreyDensityOptions options = above(dot(slope, middle_of(scan)) - 40 + 1.25);
      const double edge = spacing.x;
      options.voxel = finer * edge;
      labels::GreyDensityReport report;
      const volume::Grid grid = labels::grey_density({}, scan, options, &report);
      EXPECT_TRUE(grid.info().transform.is_cubic());
      const TriangleMesh mesh = surface::marching_cubes({}, grid).mesh;
      EXPECT_TRUE(mesh::examine_mesh(mesh).closed());
      double largest = 0;
      std::size_t inner = 0;
      for (const Vec3& p : mesh.points) {
        const Vec3 index = scan.transform.to_index(p);
        bool at_edge = false;
        for (int a = 0; a < 3; ++a)
          at_edge =
              at_edge || index[a] < 1 || index[a] > scan.size[static_cast<std::size_t>(a)] - 2;
        if (at_edge)
          continue;
        ++inner;
        largest = test::larger(largest, std::fabs(dot(slope, p) - 40 - options.low) / norm(slope));
      }
      EXPECT_GT(inner, 100U);
      // Densities are floats.
      EXPECT_LT(largest, 1e-5 * edge) << spacing.z << ' ' << finer;
    }
  }
}

TEST(GreyDensity, WhatIsFarFromTheSurfaceMovesNothing) {
  const auto ball = [](const Vec3& p) { return 10 - norm(p - Vec3{4, 15, 14}); };
  const labels::GreyVolume plain = scan_of({28, 28, 28}, {1, 1, 1}, 0, ball);
  const labels::GreyVolume metal = scan_of({28, 28, 28}, {1, 1, 1}, 0, [&](const Vec3& p) {
    return ball(p) > 4 ? 3000 : ball(p) < -4 ? -2000 : ball(p);
  });
  labels::GreyDensityReport report;
  const TriangleMesh a =
      surface::marching_cubes({}, labels::grey_density({}, plain, above(0.5), &report)).mesh;
  EXPECT_GT(report.width, 0.8); // neighbours of the surface are within a voxel's diagonal of it
  EXPECT_LT(report.width, 1.75);
  const TriangleMesh b =
      surface::marching_cubes({}, labels::grey_density({}, metal, above(0.5))).mesh;
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_NEAR(volume_of(a) / (4.0 / 3 * std::numbers::pi * 9.5 * 9.5 * 9.5), 1, 0.01); // chords
}

// Between two thresholds, and below one, the rest: volumes add up.
TEST(GreyDensity, TwoThresholdsBoundAShell) {
  const labels::GreyVolume scan =
      scan_of({30, 30, 16}, {1, 1, 2}, 0.2, [](const Vec3&) { return 0.0; });
  labels::GreyVolume ball = scan;
  const Vec3 centre = middle_of(scan);
  ball = scan_of({30, 30, 16}, {1, 1, 2}, 0.2,
                 [&](const Vec3& p) { return 100 - 10 * norm(p - centre); });
  labels::GreyDensityOptions shell = above(-10);
  shell.high = 50;
  const double between =
      volume_of(surface::marching_cubes({}, labels::grey_density({}, ball, shell)).mesh);
  const double outer =
      volume_of(surface::marching_cubes({}, labels::grey_density({}, ball, above(-10))).mesh);
  const double inner =
      volume_of(surface::marching_cubes({}, labels::grey_density({}, ball, above(50))).mesh);
  EXPECT_NEAR(between / (outer - inner), 1, 1e-3);
  EXPECT_NEAR(outer / (4.0 / 3 * std::numbers::pi * 11 * 11 * 11), 1, 0.01);
}

TEST(GreyDensity, VoxelsWithoutAValueAreOutside) {
  labels::GreyVolume scan = scan_of({12, 12, 12}, {1, 1, 1}, 0, [](const Vec3& p) {
    return norm(p - Vec3{-2, 10, 8}) < 4 ? 60.0 : 10.0;
  });
  scan.values[scan.row(5, 5) + 6] = NAN; // in the middle
  scan.values[0] = NAN;
  labels::GreyDensityReport report;
  const volume::Grid grid = labels::grey_density({}, scan, above(35), &report);
  EXPECT_EQ(report.missing, 2U);
  EXPECT_EQ(report.min, 10);
  EXPECT_EQ(report.max, 60);
  EXPECT_EQ(report.width, 25);
  volume::GridAccessor value(grid);
  EXPECT_EQ(value.value({6, 5, 5}), 0);
  EXPECT_EQ(value.value({6, 5, 6}), 1);
  EXPECT_TRUE(std::isfinite(volume_of(surface::marching_cubes({}, grid).mesh)));
}

TEST(GreyDensity, WhatHasNoSurfaceIsRefused) {
  const labels::GreyVolume scan =
      scan_of({6, 6, 6}, {1, 1, 1}, 0, [](const Vec3& p) { return p.x < -5 ? 200.0 : -100.0; });
  EXPECT_EQ(message(scan, above(200)),
            "no voxel lies within the thresholds; values go from -100 to 200");
  EXPECT_EQ(message(scan, above(-101)),
            "every voxel lies within the thresholds; values go from -100 to 200");
  labels::GreyVolume empty = scan;
  for (float& v : empty.values)
    v = NAN;
  EXPECT_EQ(message(empty, above(0)), "no voxel has a value");
  labels::GreyVolume oblique = scan;
  oblique.transform.m[1] = 0.5;
  EXPECT_NE(message(oblique, above(0)).find("the axes are oblique"), std::string::npos);
  Context little;
  little.max_memory = 1000;
  EXPECT_THROW((void)labels::grey_density(little, scan, above(0)), Error);
  // The same bytes by any number of threads.
  Context one;
  one.threads = 1;
  Context two;
  two.threads = 2;
  EXPECT_EQ(labels::grey_density(one, scan, above(0)).digest(),
            labels::grey_density(two, scan, above(0)).digest());
}
