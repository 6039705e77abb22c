#include "stuffing/stuffing.h"

#include "base/error.h"
#include "stuffing/materials.h"
#include "stuffing/surface_distance.h"
#include "stuffing/warp_internal.h"
#include "tests/unit/complaint.h"
#include "tests/unit/larger.h"
#include "tests/unit/stuffing_checks.h"
#include "tests/unit/surface_scenes.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/check.h"
#include "tetrahedra/components.h"
#include "tetrahedra/quality.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using namespace scenes;

TEST(Stuffing, VolumeAndDistanceConvergeWithTheSquareOfTheCell) {
  struct Shape {
    volume::Grid grid;
    double volume;
    std::int64_t euler;
  };
  const std::vector<Shape> shapes{{ball_grid(5, 0.125), 4 * pi / 3 * 125, 2},
                                  {torus(5, 2, 0.125), 2 * pi * pi * 5 * 4, 0}};
  for (const Shape& shape : shapes) {
    std::vector<double> errors, distances;
    for (const double cell : {1.0, 0.5, 0.25}) {
      const tetrahedra::TetMesh mesh = stuffed(shape.grid, {{}, cell});
      const TriangleMesh surface = tetrahedra::boundary(mesh).mesh;
      EXPECT_EQ(mesh::topology(surface).euler, shape.euler);
      const stuffing::SurfaceDistance distance =
          stuffing::surface_distance({}, shape.grid, {{}, cell}, surface);
      EXPECT_EQ(distance.beyond_cell, 0U);
      errors.push_back(std::fabs(tetrahedra::volume(mesh) / shape.volume - 1));
      EXPECT_LT(distance.largest, 0.16 * cell * cell);
      distances.push_back(distance.mean);
    }
    for (std::size_t n = 1; n < errors.size(); ++n) {
      EXPECT_GT(errors[n - 1] / errors[n], 3.2) << n;
      EXPECT_GT(distances[n - 1] / distances[n], 3.2) << n;
    }
    EXPECT_LT(errors.back(), 0.004);
  }
}

TEST(Stuffing, AnythingKeepsTheBoundsAndAManifold) {
  // Noise of two values, noise in between, and waves, on straight, mirrored and sheared axes.
  std::uint64_t refused = 0;
  for (std::uint32_t seed = 0; seed < 24; ++seed) {
    std::mt19937 random(seed);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    const volume::GridInfo info = turned_axes(seed);
    const double share = 0.2 + 0.6 * uniform();
    const volume::Grid grid =
        sample(info, {-8, 0, 0}, {7, 7, 9}, [&](int i, int j, int k) -> double {
          switch (seed / 3 % 3) {
          case 0:
            return uniform() < share ? 1 : 0;
          case 1:
            return uniform() + share - 0.5;
          default:
            return 0.5 +
                   0.5 * std::sin(i * 0.9 + seed) * std::cos(j * 1.1) * std::sin(k * 0.8 + 1) +
                   0.1 * (uniform() - 0.5);
          }
        });
    stuffing::StuffingOptions options;
    if (seed % 4 != 0)
      options.cell = 0.45 + uniform();
    stuffing::StuffingReport report;
    const tetrahedra::TetMesh one = stuffed(grid, options, 1, &report);
    const tetrahedra::TetMesh two = stuffed(grid, options, 2);
    EXPECT_EQ(one.tetrahedra, two.tetrahedra);
    EXPECT_EQ(one.points, two.points);
    refused += report.refused_warps;
  }
  EXPECT_GT(refused, 100U); // the scenes ask for it
}

TEST(Stuffing, AGradedSolidHasTheSameBoundaryAndCoarserCellsInside) {
  const volume::Grid grid = ball_grid(5, 0.125);
  stuffing::StuffingReport fine;
  const tetrahedra::TetMesh uniform = stuffed(grid, {{}, 0.2}, 1, &fine);
  const auto first = [&](const tetrahedra::TetMesh& mesh) {
    return std::vector<Vec3>(mesh.points.begin(),
                             mesh.points.begin() + static_cast<std::ptrdiff_t>(fine.surface_nodes));
  };
  std::size_t before = uniform.tetrahedra.size();
  double largest = 0;
  for (const unsigned grade : {1U, 2U, 3U}) {
    const tetrahedra::TetMesh mesh = stuffed(grid, {{}, 0.2, grade});
    EXPECT_EQ(first(mesh), first(uniform)) << grade;
    EXPECT_EQ(boundary_triangles(mesh), boundary_triangles(uniform)) << grade;
    EXPECT_NEAR(tetrahedra::volume(mesh), tetrahedra::volume(uniform),
                1e-11 * tetrahedra::volume(uniform))
        << grade;
    EXPECT_LT(mesh.tetrahedra.size(), before) << grade;
    before = mesh.tetrahedra.size();
    double here = 0;
    for (const auto& [a, b, c, d] : mesh.tetrahedra)
      here = test::larger(here, tetrahedra::tetrahedron_volume(mesh.points[a], mesh.points[b],
                                                               mesh.points[c], mesh.points[d]));
    EXPECT_GT(here, largest) << grade;
    largest = here;
  }
  // Cells of 8 have tetrahedra of 8^3 / 12.
  EXPECT_NEAR(largest, 512 * 0.008 / 12, 1e-12);
  EXPECT_LT(before, uniform.tetrahedra.size() / 2);
  EXPECT_THROW(stuffing::stuff({}, grid, {{}, 0.2, 4}), Error);
}

TEST(Stuffing, GradedWavesKeepTheBoundsAndTheirBoundary) {
  for (std::uint32_t seed = 0; seed < 6; ++seed) {
    std::mt19937 random(seed);
    const volume::GridInfo info = turned_axes(seed);
    const volume::Grid grid = sample(info, {-9, 0, 0}, {9, 19, 19}, [&](int i, int j, int k) {
      const double noise = static_cast<double>(random()) / 4294967296.0 - 0.5;
      return 0.6 + 0.5 * std::sin(i * 0.31 + seed) * std::cos(j * 0.34) * std::sin(k * 0.29 + 1) +
             0.15 * noise;
    });
    stuffing::StuffingOptions options{{}, 0.48 + 0.02 * seed};
    const tetrahedra::TetMesh fine = stuffed(grid, options, 2);
    options.grade = 1 + seed / 2;
    const tetrahedra::TetMesh graded = stuffed(grid, options, 1), again = stuffed(grid, options, 2);
    EXPECT_EQ(graded.tetrahedra, again.tetrahedra);
    EXPECT_EQ(graded.points, again.points);
    EXPECT_LT(graded.tetrahedra.size(), 0.9 * static_cast<double>(fine.tetrahedra.size()));
    EXPECT_EQ(boundary_triangles(graded), boundary_triangles(fine));
    EXPECT_NEAR(tetrahedra::volume(graded), tetrahedra::volume(fine),
                1e-10 * tetrahedra::volume(fine));
  }
}

/// The corners of tetrahedra with one of the first `surface` points.
std::vector<std::array<std::array<double, 3>, 4>> at_boundary(const tetrahedra::TetMesh& mesh,
                                                              std::size_t surface) {
  std::vector<std::array<std::array<double, 3>, 4>> result;
  for (const Tetrahedron& tetrahedron : mesh.tetrahedra) {
    if (*std::min_element(tetrahedron.begin(), tetrahedron.end()) >= surface)
      continue;
    auto& corners = result.emplace_back();
    for (std::size_t n = 0; n < 4; ++n) {
      const Vec3& p = mesh.points[tetrahedron[n]];
      corners[n] = {p.x, p.y, p.z};
    }
    std::sort(corners.begin(), corners.end());
  }
  std::sort(result.begin(), result.end());
  return result;
}

TEST(Stuffing, AGradedSolidKeepsRoundSinglePointsWhatIsThere) {
  // Lattice points stand at every voxel with three even or three odd indices; all next to one
  // outside are moved.
  std::mt19937 random(5);
  const volume::Grid grid = sample({}, {0, 0, 0}, {40, 40, 40},
                                   [&](int, int, int) { return random() % 400 == 0 ? -1 : 0.51; });
  const tetrahedra::TetMesh fine = stuffed(grid, {{}, 2.0}, 2),
                            graded = stuffed(grid, {{}, 2.0, 1}, 2);
  EXPECT_LT(graded.tetrahedra.size(), 0.99 * static_cast<double>(fine.tetrahedra.size()));
  EXPECT_EQ(boundary_triangles(graded), boundary_triangles(fine));
  const std::size_t surface = tetrahedra::boundary(fine).node.size();
  EXPECT_EQ(at_boundary(graded, surface), at_boundary(fine, surface));
}

TEST(Stuffing, BetweenLeavesAnglesAreOf45To120Degrees) {
  // All tetrahedra without a node on the boundary.
  const tetrahedra::TetMesh mesh = stuffed(ball_grid(5, 0.125), {{}, 0.2, 3});
  stuffing::StuffingReport report;
  stuffing::stuff({}, ball_grid(5, 0.125), {{}, 0.2, 3}, &report);
  tetrahedra::TetMesh inner = mesh;
  std::erase_if(inner.tetrahedra, [&](const Tetrahedron& tetrahedron) {
    return *std::min_element(tetrahedron.begin(), tetrahedron.end()) < report.surface_nodes;
  });
  // Leave out those of single cells, which may be warped.
  const double single = 0.2 * 0.2 * 0.2 / 12;
  std::erase_if(inner.tetrahedra, [&](const Tetrahedron& t) {
    const double size = tetrahedra::tetrahedron_volume(inner.points[t[0]], inner.points[t[1]],
                                                       inner.points[t[2]], inner.points[t[3]]);
    return size < single * 1.5 && std::fabs(size / single - 0.5) > 1e-9;
  });
  EXPECT_GT(inner.tetrahedra.size(), 1000U);
  const tetrahedra::TetQuality quality =
      tetrahedra::tet_quality(inner, tetrahedra::boundary(inner));
  EXPECT_NEAR(quality.smallest_angle, 45, 1e-6);
  EXPECT_LT(quality.largest_angle, 120 + 1e-6);
}

TEST(Stuffing, WarpsThatPinchAreSeen) {
  const auto signs = [](std::initializer_list<unsigned> inside,
                        std::initializer_list<unsigned> outside) {
    stuffing::LinkSigns result;
    for (const unsigned d : inside)
      result.inside |= 1U << d;
    for (const unsigned d : outside)
      result.outside |= 1U << d;
    return result;
  };
  const stuffing::LinkSigns all{(1U << stuffing::bcc::directions) - 1, 0};
  EXPECT_EQ(stuffing::meeting(all), stuffing::Meeting::interior);
  EXPECT_EQ(stuffing::meeting({}), stuffing::Meeting::nothing);
  EXPECT_EQ(stuffing::meeting({0, all.inside}), stuffing::Meeting::nothing);
  // Half of the sphere above the plane z = 0, with the four points in the plane on the surface.
  EXPECT_EQ(stuffing::meeting(signs({5, 10, 11, 12, 13}, {4, 6, 7, 8, 9})),
            stuffing::Meeting::boundary);
  // One corner inside; two opposite ones: the boundary is two cones.
  EXPECT_EQ(stuffing::meeting({1U, all.inside & ~1U}), stuffing::Meeting::boundary);
  EXPECT_EQ(stuffing::meeting({3U, all.inside & ~3U}), stuffing::Meeting::pinched);
  // Outside at two opposite corners, nothing between: a tunnel that touches itself.
  EXPECT_EQ(stuffing::meeting({all.inside & ~3U, 3U}), stuffing::Meeting::pinched);
  // Two short directions that share no face, in a surrounding on the surface.
  EXPECT_EQ(stuffing::meeting(signs({6, 13}, {})), stuffing::Meeting::pinched);
  // They share an edge.
  EXPECT_EQ(stuffing::meeting(signs({6, 7}, {})), stuffing::Meeting::boundary);
}

TEST(Stuffing, ALatticeOnVoxelCentresHasItsCutsWhereValuesSay) {
  // A plane between voxels: each point of the boundary lies on it, since long edges are linear and
  // short ones see a trilinear function that depends on one axis.
  const double height = 3.3;
  const volume::Grid grid = sample(volume::GridInfo{}, {0, 0, 0}, {15, 15, 7},
                                   [&](int, int, int k) { return 0.5 + (height - k) / 8.0; });
  stuffing::StuffingReport report;
  const tetrahedra::TetMesh mesh = stuffed(grid, {}, 1, &report);
  std::size_t near = 0;
  for (const Vec3& p : std::span(mesh.points).first(report.surface_nodes))
    if (p.x > 1 && p.x < 14 && p.y > 1 && p.y < 14 && p.z > 2) {
      EXPECT_NEAR(p.z, height, 1e-6); // values are float
      ++near;
    }
  EXPECT_GT(near, 300U);
}

TEST(Stuffing, ComponentsStayApartAndAreCounted) {
  const volume::Grid grid = sample(level_set(volume::uniform_transform(0.5), 9), {-8, -8, -8},
                                   {40, 8, 8}, [](int i, int j, int k) {
                                     const Vec3 p{i * 0.5, j * 0.5, k * 0.5};
                                     return std::min(norm(p) - 2, norm(p - Vec3{12, 0, 0}) - 3);
                                   });
  tetrahedra::TetMesh mesh = stuffed(grid);
  EXPECT_EQ(tetrahedra::component_count(mesh), 2U);
  const double all = tetrahedra::volume(mesh);
  const tetrahedra::TetComponentReport report = tetrahedra::keep_components(mesh, {1, 0});
  EXPECT_EQ(report.kept, 1U);
  EXPECT_EQ(report.dropped, 1U);
  EXPECT_EQ(tetrahedra::component_count(mesh), 1U);
  EXPECT_NEAR(report.dropped_volume, 4 * pi / 3 * 8, 2);
  EXPECT_NEAR(tetrahedra::volume(mesh) + report.dropped_volume, all, 1e-9 * all);
  EXPECT_EQ(tetrahedra::examine_tetrahedra(mesh).unused_points.count, 0U);
}

Vec3 centroid_of(const tetrahedra::TetMesh& mesh, std::size_t t) {
  Vec3 sum;
  for (const std::uint32_t corner : mesh.tetrahedra[t])
    sum += mesh.points[corner] / 4;
  return sum;
}

/// 1, 2, … inside the last of the volumes that holds a place.
stuffing::MaterialSource layers(const std::vector<volume::Grid>& volumes) {
  std::vector<stuffing::MaterialSource> sources;
  for (const volume::Grid& volume : volumes)
    sources.push_back(stuffing::inside_source(volume));
  return [sources] {
    std::vector<stuffing::MaterialAt> inside;
    for (const stuffing::MaterialSource& source : sources)
      inside.push_back(source());
    return [inside](const Vec3& place) {
      std::int32_t material = 0;
      for (std::size_t n = 0; n < inside.size(); ++n)
        material = inside[n](place) != 0 ? static_cast<std::int32_t>(n + 1) : material;
      return material;
    };
  };
}

TEST(Stuffing, MaterialsFollowTheirVolumes) {
  tetrahedra::TetMesh mesh = stuffed(ball_grid(5, 0.25), {{}, 0.5});
  std::vector<volume::Grid> volumes;
  volumes.push_back(ball_grid(2, 0.2, {0.3, 0, 0}));
  volumes.push_back(ball_grid(1, 0.3, {0.3, 0, 0}));
  stuffing::set_materials({}, layers(volumes), mesh);
  ASSERT_EQ(mesh.material.size(), mesh.tetrahedra.size());
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const double r = norm(centroid_of(mesh, t) - Vec3{0.3, 0, 0});
    if (std::fabs(r - 1) > 0.05 && std::fabs(r - 2) > 0.05) {
      ASSERT_EQ(mesh.material[t], r < 1 ? 2 : r < 2 ? 1 : 0) << r;
    }
  }
  const tetrahedra::TetQuality quality = tetrahedra::tet_quality(mesh);
  ASSERT_EQ(quality.materials.size(), 3U);
  EXPECT_NEAR(quality.materials[1].volume, 4 * pi / 3 * 7, 1.5);
  EXPECT_NEAR(quality.materials[2].volume, 4 * pi / 3, 0.5);
}

/// Labels of a box of voxels from a function of the voxel.
template <class Label>
labels::LabelRuns labels_of(const Int3& size, const volume::GridTransform& transform, Label label) {
  labels::LabelRuns all{size, transform, {}, {0}};
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i)
        if (i == 0 || label(i, j, k) != label(i - 1, j, k))
          all.runs.push_back({i + 1, label(i, j, k)});
        else
          ++all.runs.back().end;
      all.rows.push_back(all.runs.size());
    }
  return all;
}

TEST(Stuffing, MaterialsAreTheLabelsOfTheNearestVoxels) {
  // Turned, mirrored and oblong voxels over a part of the ball.
  volume::GridTransform lattice;
  const double c = std::cos(0.5), s = std::sin(0.5);
  lattice.m = {c * 0.9, -s * 1.3, 0, -2, s * 0.9, c * 1.3, 0, -3, 0, 0, -0.7, 2.5};
  const Int3 size{6, 5, 7};
  const auto label = [](int i, int j, int k) { return (i * 7 + j * 5 + k * 3) % 4; };
  const labels::LabelRuns labels = labels_of(size, lattice, label);
  tetrahedra::TetMesh mesh = stuffed(ball_grid(5, 0.25), {{}, 0.8});
  stuffing::set_materials({}, stuffing::label_source(labels), mesh);
  ASSERT_EQ(mesh.material.size(), mesh.tetrahedra.size());
  std::array<int, 4> seen{};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const Vec3 p = centroid_of(mesh, t);
    // The nearest of all centres, and of those round the box, whose label is 0.
    std::vector<std::pair<double, int>> near;
    for (int k = -1; k <= size[2]; ++k)
      for (int j = -1; j <= size[1]; ++j)
        for (int i = -1; i <= size[0]; ++i) {
          const bool within =
              i >= 0 && i < size[0] && j >= 0 && j < size[1] && k >= 0 && k < size[2];
          near.emplace_back(norm(lattice.to_world({1.0 * i, 1.0 * j, 1.0 * k}) - p),
                            within ? label(i, j, k) : 0);
        }
    std::partial_sort(near.begin(), near.begin() + 2, near.end());
    if (near[1].first - near[0].first > 1e-9) {
      const int expected = near[0].second;
      ASSERT_EQ(mesh.material[t], expected) << t;
      ++seen[static_cast<std::size_t>(expected)];
    }
  }
  for (const int count : seen)
    EXPECT_GT(count, 200);
}

TEST(Stuffing, MaterialsOfObliqueLabels) {
  // Faces of voxels divide the labels: the plane i = 5½, along the second and the third axis.
  volume::GridTransform lattice;
  lattice.m = {-1, 0.3, 0.1, 4, 0.2, 1.2, -0.2, -6, 0, 0.1, 1.1, -7};
  const labels::LabelRuns labels =
      labels_of({12, 12, 14}, lattice, [](int i, int, int) { return i < 6 ? 1 : 2147483647; });
  tetrahedra::TetMesh mesh = stuffed(ball_grid(3, 0.25), {{}, 0.5});
  stuffing::set_materials({}, stuffing::label_source(labels), mesh);
  const Vec3 on_plane = lattice.to_world({5.5, 0, 0});
  const Vec3 across = cross({0.3, 1.2, 0.1}, {0.1, -0.2, 1.1});
  std::array<int, 2> seen{};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
    const bool low =
        dot(centroid_of(mesh, t) - on_plane, across) > 0; // the first axis points to -x
    ASSERT_EQ(mesh.material[t], low ? 1 : 2147483647) << t;
    ++seen[low ? 0 : 1];
  }
  EXPECT_GT(seen[0], 1000);
  EXPECT_GT(seen[1], 1000);

  labels::LabelRuns flat = labels;
  flat.transform.m[0] = flat.transform.m[4] = 0;
  EXPECT_THROW(stuffing::set_materials({}, stuffing::label_source(flat), mesh), Error);
}

TEST(Stuffing, MaterialsOfTheNearestLabel) {
  volume::GridTransform lattice;
  const double c = std::cos(0.5), s = std::sin(0.5);
  lattice.m = {c * 0.9, -s * 1.3, 0, -4, s * 0.9, c * 1.3, 0, -5, 0, 0, -0.7, 4};
  const Int3 size{9, 8, 11};
  const auto label = [](int i, int j, int k) {
    return (i * 7 + j * 5 + k * 3) % 29 == 0 ? 1 + (i + j) % 3 : 0;
  };
  const labels::LabelRuns labels = labels_of(size, lattice, label);
  const tetrahedra::TetMesh mesh = stuffed(ball_grid(7, 0.25), {{}, 1.5});
  for (const int reach : {0, 1, 2}) {
    tetrahedra::TetMesh with = mesh;
    stuffing::set_materials({}, stuffing::label_source(labels, reach), with);
    std::array<int, 4> seen{};
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
      const Vec3 p = centroid_of(mesh, t), index = lattice.to_index(p);
      // All labelled voxels by their distances, the voxel itself before all.
      std::vector<std::pair<double, int>> near{{1e9, 0}, {1e9, 0}};
      bool clear = true;
      for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
          for (int i = 0; i < size[0]; ++i) {
            const Vec3 centre{1.0 * i, 1.0 * j, 1.0 * k}, apart = index - centre;
            const double steps =
                std::max({std::fabs(apart.x), std::fabs(apart.y), std::fabs(apart.z)});
            clear = clear && std::fabs(steps - reach - 0.5) > 1e-9;
            if (label(i, j, k) != 0 && steps < reach + 0.5)
              near.emplace_back(steps < 0.5 ? 0 : norm(lattice.to_world(centre) - p),
                                label(i, j, k));
          }
      std::partial_sort(near.begin(), near.begin() + 2, near.end());
      if (clear && (near[1].first == 1e9 || near[1].first - near[0].first > 1e-9)) {
        ASSERT_EQ(with.material[t], near[0].second) << t << " " << reach;
        ++seen[static_cast<std::size_t>(near[0].second)];
      }
    }
    for (const int count : seen)
      EXPECT_GT(count, 10) << reach;
  }
}

TEST(Stuffing, UnlabelledTissueIsNoBackground) {
  // Labels of a ball with a core that has none; the smooth ball cuts the stairs of its voxels.
  const double radius = 6, core = 3, size = 0.5;
  volume::GridTransform lattice = volume::uniform_transform(size);
  lattice.m[3] = lattice.m[7] = lattice.m[11] = -8;
  const Vec3 center{0.13, -0.21, 0.07};
  const labels::LabelRuns labels = labels_of({33, 33, 33}, lattice, [&](int i, int j, int k) {
    const Vec3 p = lattice.to_world({1.0 * i, 1.0 * j, 1.0 * k});
    const double apart = norm(p - center);
    return apart > radius || apart < core ? 0 : p.x < 0 ? 1 : 2;
  });
  const volume::Grid solid = ball_grid(radius, 0.25, center);
  tetrahedra::TetMesh mesh = stuffed(solid, {{}, 0.4});
  const auto zeros = [&](double from, double to) {
    int count = 0;
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
      const double apart = norm(centroid_of(mesh, t) - center);
      count += apart >= from && apart < to && mesh.material[t] == 0;
    }
    return count;
  };
  const double diagonal = std::sqrt(3.0) * size;
  stuffing::set_materials({}, stuffing::label_source(labels), mesh);
  EXPECT_GT(zeros(core + diagonal, HUGE_VAL), 100);
  const int in_core = zeros(0, core + diagonal);
  stuffing::set_materials({}, stuffing::label_source(labels, 3, stuffing::inside_source(solid)),
                          mesh);
  EXPECT_EQ(zeros(core + diagonal, HUGE_VAL), 0);
  EXPECT_EQ(zeros(0, core + diagonal), in_core);
  // Without the solid the core is background, too, where labels are near.
  stuffing::set_materials({}, stuffing::label_source(labels, 3), mesh);
  EXPECT_LT(zeros(0, core + diagonal), in_core);
  // An isovalue of its own takes the core out of the solid.
  stuffing::set_materials(
      {}, stuffing::label_source(labels, 3, stuffing::inside_source(solid, -10)), mesh);
  EXPECT_LT(zeros(0, core + diagonal), in_core);
}

TEST(Stuffing, EmptyAndTiles) {
  EXPECT_TRUE(stuffed(sample(volume::GridInfo{}, {0, 0, 0}, {7, 7, 7}, [](int, int, int) {
                return 0.2;
              })).tetrahedra.empty());
  // Tiles make the mesh that leaves make.
  const auto block = [](bool tiles) {
    return sample(
        volume::GridInfo{}, {0, 0, 0}, {23, 15, 15}, [](int, int, int) { return 1.0; }, tiles);
  };
  const tetrahedra::TetMesh with = stuffed(block(true)), without = stuffed(block(false));
  EXPECT_FALSE(with.tetrahedra.empty());
  EXPECT_EQ(with.points, without.points);
  EXPECT_EQ(with.tetrahedra, without.tetrahedra);
  // A voxel's share of the ramp between the values lies on each side.
  EXPECT_NEAR(tetrahedra::volume(with), 24 * 16 * 16, 0.02 * 24 * 16 * 16);
}

std::string complaint(const volume::Grid& grid, const stuffing::StuffingOptions& options = {}) {
  return test::complaint([&] { return stuffing::stuff({}, grid, options); });
}

TEST(Stuffing, WhatItCannotServeIsRefused) {
  const auto cube = [](volume::GridInfo info, double value) {
    return sample(
        info, {0, 0, 0}, {7, 7, 7}, [&](int, int, int) { return value; }, false);
  };
  EXPECT_NE(complaint(cube({}, NAN)).find("not finite"), std::string::npos);
  EXPECT_NE(complaint(cube({}, HUGE_VAL)).find("not finite"), std::string::npos);
  volume::GridInfo info;
  info.background = 1;
  EXPECT_NE(complaint(cube(info, 0)).find("background is inside"), std::string::npos);
  info = {};
  info.transform.m[0] = 0;
  EXPECT_NE(complaint(cube(info, 1)).find("singular"), std::string::npos);
  info = {};
  info.band_isovalue = 0.3;
  EXPECT_NE(complaint(cube(info, 1)).find("--band"), std::string::npos);
  for (const double cell : std::vector<double>{0, -1, NAN, HUGE_VAL})
    EXPECT_NE(complaint(cube({}, 1), {{}, cell}).find("a cell of"), std::string::npos);
  EXPECT_NE(complaint(cube({}, 1), {{}, 1e-12}).find("larger --cell"), std::string::npos);
  Context little;
  little.max_memory = 100000;
  EXPECT_THROW(stuffing::stuff(little, ball_grid(5, 0.25), {}), Error);
}

} // namespace
} // namespace gewebe::test
