// Solids with cells of several sizes, also where the surface is.

#include "base/error.h"
#include "stuffing/background_internal.h"
#include "stuffing/materials.h"
#include "stuffing/octree_internal.h"
#include "stuffing/stuffing.h"
#include "stuffing/surface_distance.h"
#include "tests/unit/complaint.h"
#include "tests/unit/larger.h"
#include "tests/unit/stuffing_checks.h"
#include "tests/unit/surface_scenes.h"
#include "tetrahedra/components.h"
#include "tetrahedra/refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

tetrahedra::TetMesh refined(const volume::Grid& grid, const stuffing::StuffingOptions& options,
                            int threads = 1, stuffing::StuffingReport* out = nullptr) {
  Context context;
  context.threads = threads;
  stuffing::StuffingReport report;
  tetrahedra::TetMesh mesh = stuffing::stuff(context, grid, options, &report);
  expect_kept(mesh, report, stuffing::stuffing_refined_angle_min,
              stuffing::stuffing_refined_angle_max);
  if (out != nullptr)
    *out = report;
  return mesh;
}

stuffing::StuffingOptions with(double cell, const std::string& regions, unsigned grade = 0) {
  stuffing::StuffingOptions options{{}, cell, grade};
  options.refine = tetrahedra::parse_refinement(regions);
  return options;
}

/// An octree of 4³ large cells, halved at random, balanced.
stuffing::StuffingOctree random_octree(std::uint32_t seed) {
  stuffing::StuffingOctree octree(4);
  for (int n = 0; n < 64; ++n)
    octree.add({3, {n / 16 - 2, n / 4 % 4 - 2, n % 4 - 2}});
  std::mt19937 random(seed);
  for (int n = 0; n < 4; ++n) {
    const std::vector<stuffing::OctreeCube> leaves = octree.leaves(3);
    const stuffing::OctreeCube& leaf = leaves[random() % leaves.size()];
    if (leaf.level > 0)
      octree.split(leaf);
  }
  octree.balance();
  return octree;
}

TEST(RefinedStuffing, LeavesThatTouchDifferByOneLevel) {
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    const stuffing::StuffingOctree octree = random_octree(seed);
    const std::vector<stuffing::OctreeCube> leaves = octree.leaves(3);
    std::array<int, 4> count{};
    double volume = 0;
    for (const stuffing::OctreeCube& leaf : leaves) {
      ++count[leaf.level];
      volume += std::ldexp(1.0, 3 * static_cast<int>(leaf.level));
    }
    EXPECT_EQ(volume, 64 * 512.0);
    for (const stuffing::OctreeCube& a : leaves)
      for (const stuffing::OctreeCube& b : leaves) {
        const Int3 p = a.first_cell(), q = b.first_cell();
        bool touch = true;
        for (std::size_t axis = 0; axis < 3; ++axis)
          touch =
              touch && p[axis] <= q[axis] + (1 << b.level) && q[axis] <= p[axis] + (1 << a.level);
        EXPECT_TRUE(!touch || (a.level <= b.level + 1 && b.level <= a.level + 1));
      }
    EXPECT_GT(count[2], 0);
  }
}

TEST(RefinedStuffing, TheBackgroundConformsWithAnglesOf45To120Degrees) {
  for (std::uint32_t seed = 0; seed < 50; ++seed) {
    const stuffing::Background background = stuffing::background_of(random_octree(seed), 3);
    tetrahedra::TetMesh mesh;
    for (const stuffing::Background::Node& node : background.nodes)
      mesh.points.push_back({node.place[0] / 2.0, node.place[1] / 2.0, node.place[2] / 2.0});
    mesh.tetrahedra = background.tetrahedra;
    const tetrahedra::TetReport found = tetrahedra::examine_tetrahedra(mesh);
    EXPECT_TRUE(found.sound());
    EXPECT_TRUE(found.manifold_boundary());
    const tetrahedra::TetBoundary surface = tetrahedra::boundary(mesh);
    const tetrahedra::TetQuality quality = tetrahedra::tet_quality(mesh, surface);
    EXPECT_GT(quality.smallest_angle, 45 - 1e-6);
    EXPECT_LT(quality.largest_angle, 120 + 1e-6);
    // All leaves but pyramids over the outer faces.
    EXPECT_EQ(mesh::topology(surface.mesh).euler, 2);
    EXPECT_GT(quality.volume, 0.7 * 64 * 512);
  }
}

TEST(RefinedStuffing, CellsAreSmallInTheRegionAndAsBeforeElsewhere) {
  const volume::Grid grid = ball_grid(5, 0.125);
  const tetrahedra::TetMesh coarse = stuffed(grid, {{}, 1.0});
  for (const unsigned grade : {0U, 1U, 2U}) {
    const tetrahedra::TetMesh mesh = refined(grid, with(1.0, "sphere:0,0,5,1:0.125", grade));
    EXPECT_EQ(mesh::topology(tetrahedra::boundary(mesh).mesh).euler, 2);
    EXPECT_GT(mesh.tetrahedra.size(), coarse.tetrahedra.size());
    EXPECT_LT(mesh.tetrahedra.size(), coarse.tetrahedra.size() + 40000);
    double near = 0, far = 0;
    for (const Tetrahedron& t : mesh.tetrahedra) {
      const Vec3 &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]],
                 &d = mesh.points[t[3]];
      double& largest = norm((a + b + c + d) / 4 - Vec3{0, 0, 5}) < 0.9 ? near : far;
      largest = test::larger(largest, tetrahedra::tetrahedron_volume(a, b, c, d));
    }
    EXPECT_LT(near, 0.125 * 0.125 * 0.125 / 12 * 2.4); // warps make some larger
    EXPECT_GT(near, 0.125 * 0.125 * 0.125 / 12 * 0.99);
    EXPECT_GT(far, 1.0 / 12 * 0.99);
  }
}

TEST(RefinedStuffing, WithAllOfTheSurfaceItConvergesAsUniformCells) {
  const volume::Grid grid = ball_grid(5, 0.25);
  const double exact = 4 * pi / 3 * 125;
  const double coarse =
                   std::fabs(tetrahedra::volume(refined(grid, with(2.0, "surface:1"))) / exact - 1),
               fine = std::fabs(
                   tetrahedra::volume(refined(grid, with(2.0, "surface:0.5"))) / exact - 1);
  EXPECT_GT(coarse / fine, 3.2);
  const tetrahedra::TetMesh mesh = refined(grid, with(2.0, "surface:0.5"));
  const stuffing::SurfaceDistance distance =
      stuffing::surface_distance({}, grid, {{}, 0.5}, tetrahedra::boundary(mesh).mesh);
  EXPECT_EQ(distance.beyond_cell, 0U);
  EXPECT_LT(distance.largest, 0.16 * 0.5 * 0.5);
  // Fewer than with cells of that size everywhere.
  EXPECT_LT(mesh.tetrahedra.size(),
            0.8 * static_cast<double>(stuffed(grid, {{}, 0.5}).tetrahedra.size()));
}

TEST(RefinedStuffing, ThinPartsThatTheCoarseCellsMissAreFound) {
  // A slab whose thin wing holds no point of the coarse lattice.
  const volume::Grid grid =
      sample(level_set(volume::uniform_transform(0.25), 9), {-20, -12, -12}, {40, 12, 12},
             [](int i, int j, int k) {
               const Vec3 p{i * 0.25, j * 0.25, k * 0.25};
               const double ball = norm(p) - 2.4;
               const double wing =
                   std::max({std::fabs(p.z - 0.65) - 0.3, std::fabs(p.y) - 1, p.x - 8, -p.x});
               return std::min(ball, wing);
             });
  const double before = tetrahedra::volume(stuffed(grid, {{}, 2.0}));
  const tetrahedra::TetMesh mesh = refined(grid, with(2.0, "box:0,-2,-1,9,2,2:0.25"));
  EXPECT_EQ(tetrahedra::component_count(mesh), 1U);
  EXPECT_GT(tetrahedra::volume(mesh), before + 4);
  // From a small region the surface is followed until the coarse lattice sees it.
  const tetrahedra::TetMesh tip = refined(grid, with(2.0, "sphere:7,0,0.65,1:0.25"));
  EXPECT_GT(tetrahedra::volume(tip), before + 0.5);
}

TEST(RefinedStuffing, MaterialsRunAlongFaces) {
  const volume::Grid grid = ball_grid(5, 0.25);
  const volume::Grid core = ball_grid(1.5, 0.125);
  stuffing::StuffingOptions options = with(1.0, "label:1:0.5", 2);
  options.materials = stuffing::inside_source(core);
  const tetrahedra::TetMesh mesh = refined(grid, options);
  ASSERT_EQ(mesh.material.size(), mesh.tetrahedra.size());
  const tetrahedra::TetQuality quality = tetrahedra::tet_quality(mesh);
  ASSERT_EQ(quality.materials.size(), 2U);
  EXPECT_NEAR(quality.materials[1].volume, 4 * pi / 3 * 1.5 * 1.5 * 1.5, 0.6);
  options.follow_interface = true;
  EXPECT_NE(test::complaint([&] { stuffing::stuff({}, grid, options); }).find("follow"),
            std::string::npos);
  EXPECT_NE(test::complaint([&] {
              stuffing::stuff({}, grid, with(1.0, "label:1:0.25"));
            }).find("no labels"),
            std::string::npos);
}

/// Of noise, waves or balls, small.
volume::Grid body(std::uint32_t seed, std::mt19937& random) {
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  const double share = 0.2 + 0.6 * uniform(), phase = 6 * uniform(), slope = 0.4 + uniform();
  std::array<Vec3, 3> at;
  for (Vec3& p : at)
    p = {6 * uniform() - 3, 6 * uniform(), 6 * uniform()};
  return sample(turned_axes(seed), {-3, 0, 0}, {3, 6, 6}, [&](int i, int j, int k) -> double {
    switch (seed / 3 % 4) {
    case 0:
      return uniform() < share ? 1 : 0;
    case 1:
      return uniform() + share - 0.5;
    case 2:
      return 0.5 + 0.5 * std::sin(i * slope + phase) * std::cos(j * 1.1) * std::sin(k * slope + 1) +
             0.1 * (uniform() - 0.5);
    default: {
      double least = HUGE_VAL;
      for (const Vec3& p : at)
        least = test::smaller(least, norm(Vec3{1.0 * i, 1.0 * j, 1.0 * k} - p));
      return 0.5 + 0.25 * (1.2 + slope - least);
    }
    }
  });
}

/// GEWEBE_BODIES says how many; ten thousand take minutes.
TEST(RefinedStuffing, AnythingKeepsTheBoundsAndAManifold) {
  std::uint64_t refused = 0, tetrahedra = 0;
  const char* const count = std::getenv("GEWEBE_BODIES");
  const auto bodies = static_cast<std::uint32_t>(count == nullptr ? 150 : std::atoi(count));
  for (std::uint32_t seed = 0; seed < bodies; ++seed) {
    std::mt19937 random(seed);
    const volume::Grid grid = body(seed, random);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    stuffing::StuffingOptions options{{}, 0.9 + uniform(), seed % 3};
    tetrahedra::RefinedRegion region;
    const Vec3 centre =
        grid.info().transform.to_world({6 * uniform() - 3, 6 * uniform(), 6 * uniform()});
    region.spheres.push_back({centre, 0.3 + 2 * uniform()});
    region.cell = *options.cell * (seed % 5 == 0 ? 0.25 : 0.5);
    options.refine.push_back(region);
    stuffing::StuffingReport report;
    tetrahedra::TetMesh mesh;
    try {
      mesh = refined(grid, options, 1, &report);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("no cell of the solid"), std::string::npos)
          << error.what();
      continue;
    }
    tetrahedra += mesh.tetrahedra.size();
    refused += report.refused_warps;
    if (seed % 10 == 0) {
      const tetrahedra::TetMesh two = refined(grid, options, 2);
      EXPECT_EQ(mesh.tetrahedra, two.tetrahedra);
      EXPECT_EQ(mesh.points, two.points);
    }
  }
  EXPECT_GT(refused, bodies / 3); // the bodies ask for it
  EXPECT_GT(tetrahedra, bodies * 200);
}

TEST(RefinedStuffing, RegionsAreReadAndRefusedByName) {
  const auto regions =
      tetrahedra::parse_refinement("sphere:1,2,3,4:0.5; surface and box:0,0,0,1,2,3:2;label:7:1");
  ASSERT_EQ(regions.size(), 3U);
  EXPECT_EQ(regions[0].spheres[0].centre, (Vec3{1, 2, 3}));
  EXPECT_EQ(regions[0].spheres[0].radius, 4);
  EXPECT_EQ(regions[0].cell, 0.5);
  EXPECT_TRUE(regions[1].surface);
  EXPECT_EQ(regions[1].boxes[0].max, (Vec3{1, 2, 3}));
  EXPECT_EQ(regions[1].cell, 2);
  EXPECT_EQ(regions[2].materials, std::vector<std::int32_t>{7});
  for (const char* const wrong : {"",
                                  "sphere",
                                  "sphere:1,2,3,4",
                                  "sphere:1,2,3:1",
                                  "sphere:1,2,3,0:1",
                                  "sphere:1,2,3,nan:1",
                                  "sphere:1,2,3,4:0",
                                  "sphere:1,2,3,4:-1",
                                  "sphere:1,2,3,4:inf",
                                  "box:1,0,0,0,1,1:1",
                                  "box:0,0,0,1,1:1",
                                  "label:1.5:1",
                                  "label:-1:1",
                                  "label::1",
                                  "surface:",
                                  "surface and:1",
                                  "inside:1",
                                  "surface:1;",
                                  "sphere:1,2,3,4x:1",
                                  "surface or label:1:1"})
    EXPECT_NE(test::complaint([&] { tetrahedra::parse_refinement(wrong); }).find("expected"),
              std::string::npos)
        << wrong;
  const volume::Grid grid = ball_grid(2, 0.25);
  const auto says = [&](const std::string& text) {
    return test::complaint([&] { stuffing::stuff({}, grid, with(1.0, text)); });
  };
  EXPECT_NE(says("surface:1").find("1 mm already"), std::string::npos);
  EXPECT_NE(says("sphere:9,0,0,2:0.5").find("no cell of the solid"), std::string::npos);
  EXPECT_NE(says("surface:0.001").find("at most 8"), std::string::npos);
}

} // namespace
} // namespace gewebe::test
