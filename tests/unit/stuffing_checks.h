#pragma once
// What the tests of stuffing share.

#include "stuffing/stuffing.h"
#include "tests/unit/surface_scenes.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/check.h"
#include "tetrahedra/quality.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

namespace gewebe::test {

using namespace scenes;

inline constexpr double pi = std::numbers::pi;

inline volume::GridInfo level_set(const volume::GridTransform& transform, float background) {
  volume::GridInfo info;
  info.transform = transform;
  info.level_set = true;
  info.background = background;
  return info;
}

/// Straight, turned and mirrored, or sheared axes.
inline volume::GridInfo turned_axes(std::uint32_t seed) {
  volume::GridInfo info;
  if (seed % 3 == 1)
    info.transform.m = {0, -0.7, 0, 2, 0.7, 0, 0, -3, 0, 0, -0.7, 1};
  if (seed % 3 == 2)
    info.transform.m = {0.5, 0.1, 0, 3, 0, 0.9, 0.05, -2, 0.02, 0, 1.4, 1};
  return info;
}

/// Exact distance to a ball, or to a torus about the z axis, in voxels of `size`.
inline volume::Grid ball_grid(double radius, double size,
                              const Vec3& center = {0.13, -0.21, 0.07}) {
  const int reach = static_cast<int>(std::ceil(radius / size)) + 3;
  return sample(level_set(volume::uniform_transform(size), 9), {-reach, -reach, -reach},
                {reach, reach, reach}, [&](int i, int j, int k) {
                  return norm(Vec3{i * size, j * size, k * size} - center) - radius;
                });
}
inline volume::Grid torus(double large, double small, double size) {
  const int reach = static_cast<int>(std::ceil((large + small) / size)) + 3;
  return sample(level_set(volume::uniform_transform(size), 9), {-reach, -reach, -reach},
                {reach, reach, reach}, [&](int i, int j, int k) {
                  const double x = i * size, y = j * size, z = k * size;
                  return std::hypot(std::hypot(x, y) - large, z) - small;
                });
}

/// What stuff() promises of any mesh.
inline void expect_kept(const tetrahedra::TetMesh& mesh, const stuffing::StuffingReport& report,
                        double smallest_angle = stuffing::stuffing_angle_min,
                        double largest_angle = stuffing::stuffing_angle_max) {
  tetrahedra::check_mesh(mesh);
  const tetrahedra::TetReport found = tetrahedra::examine_tetrahedra(mesh);
  EXPECT_TRUE(found.sound());
  EXPECT_EQ(found.inverted.count, 0U);
  EXPECT_EQ(found.unused_points.count, 0U);
  EXPECT_TRUE(found.manifold_boundary());
  const tetrahedra::TetBoundary surface = tetrahedra::boundary(mesh);
  ASSERT_EQ(surface.node.size(), report.surface_nodes);
  for (std::size_t n = 0; n < surface.node.size(); ++n)
    ASSERT_EQ(surface.node[n], n);
  if (mesh.tetrahedra.empty())
    return;
  const tetrahedra::TetQuality quality = tetrahedra::tet_quality(mesh, surface);
  EXPECT_GE(quality.smallest_angle, smallest_angle);
  EXPECT_LE(quality.largest_angle, largest_angle);
  EXPECT_GT(quality.smallest_volume, 0);
  EXPECT_EQ(report.cut_nodes + report.warped, report.surface_nodes);
}

inline tetrahedra::TetMesh stuffed(const volume::Grid& grid,
                                   const stuffing::StuffingOptions& options = {}, int threads = 1,
                                   stuffing::StuffingReport* out = nullptr) {
  Context context;
  context.threads = threads;
  stuffing::StuffingReport report;
  tetrahedra::TetMesh mesh = stuffing::stuff(context, grid, options, &report);
  expect_kept(mesh, report,
              options.follow_interface ? stuffing::stuffing_interface_angle_min
                                       : stuffing::stuffing_angle_min);
  if (out != nullptr)
    *out = report;
  return mesh;
}

/// The triangles of the boundary, each from its least corner.
inline std::vector<Triangle> boundary_triangles(const tetrahedra::TetMesh& mesh) {
  std::vector<Triangle> triangles = tetrahedra::boundary(mesh).mesh.triangles;
  for (Triangle& triangle : triangles)
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()),
                triangle.end());
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

} // namespace gewebe::test
