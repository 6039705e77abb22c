#include "base/error.h"
#include "stuffing/bcc_internal.h"
#include "stuffing/interface_internal.h"
#include "stuffing/lattice_internal.h"
#include "stuffing/stuffing.h"
#include "stuffing/warp_internal.h"
#include "tests/unit/larger.h"
#include "tests/unit/stuffing_checks.h"
#include "tetrahedra/faces.h"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <random>

namespace gewebe::test {
namespace {

/// Material 1 in a ball about a place, else 0.
stuffing::MaterialSource in_ball(const Vec3& center, double radius) {
  return [=] {
    return [=](const Vec3& place) -> std::int32_t { return norm(place - center) < radius ? 1 : 0; };
  };
}

std::map<std::int32_t, double> volumes(const tetrahedra::TetMesh& mesh) {
  std::map<std::int32_t, double> result;
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
    const auto& [a, b, c, d] = mesh.tetrahedra[n];
    result[mesh.material[n]] += tetrahedra::tetrahedron_volume(mesh.points[a], mesh.points[b],
                                                               mesh.points[c], mesh.points[d]);
  }
  return result;
}

/// The triangles between two materials.
std::vector<Triangle> interface_of(const tetrahedra::TetMesh& mesh) {
  std::map<Triangle, std::int32_t> open;
  std::vector<Triangle> result;
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n)
    for (const auto& face : tetrahedra::tetrahedron_faces) {
      Triangle triangle{};
      for (std::size_t c = 0; c < 3; ++c)
        triangle[c] = mesh.tetrahedra[n][face[c]];
      std::sort(triangle.begin(), triangle.end());
      const auto [there, first] = open.emplace(triangle, mesh.material[n]);
      if (first)
        continue;
      if (there->second != mesh.material[n])
        result.push_back(triangle);
      open.erase(there);
    }
  return result;
}

TEST(StuffingInterface, ABallInABallConvergesWithTheSquareOfTheCell) {
  const volume::Grid grid = ball_grid(5, 0.25);
  const Vec3 center{0.7, -0.4, 0.3};
  std::vector<double> errors, distances;
  for (const double cell : {1.0, 0.5, 0.25}) {
    stuffing::StuffingOptions options{{}, cell};
    const std::vector<Triangle> outer = boundary_triangles(stuffed(grid, options));
    options.materials = in_ball(center, 2);
    options.follow_interface = true;
    stuffing::StuffingReport report;
    const tetrahedra::TetMesh mesh = stuffed(grid, options, 1, &report);
    EXPECT_EQ(boundary_triangles(mesh), outer);
    EXPECT_GT(report.interface_cuts, 0U);
    EXPECT_GT(report.interface_warped, 0U);
    EXPECT_EQ(report.interface_kept, 0U); // nothing else is near
    double farthest = 0;
    for (const Triangle& triangle : interface_of(mesh))
      for (const std::uint32_t node : triangle)
        farthest = test::larger(farthest, std::fabs(norm(mesh.points[node] - center) - 2));
    distances.push_back(farthest);
    errors.push_back(std::fabs(volumes(mesh).at(1) / (4 * pi / 3 * 8) - 1));
  }
  // Nodes are on the interface, but those whose warp was taken back.
  EXPECT_LT(distances.back(), 0.05);
  for (std::size_t n = 1; n < errors.size(); ++n)
    EXPECT_GT(errors[n - 1] / errors[n], 3) << n;
  EXPECT_LT(errors.back(), 0.01);
}

TEST(StuffingInterface, AStaircaseHasTheMaterialOfTheCentroid) {
  stuffing::StuffingOptions options{{}, 0.5};
  const tetrahedra::TetMesh bare = stuffed(ball_grid(5, 0.25), options);
  options.materials = in_ball({0, 0, 0}, 3);
  const tetrahedra::TetMesh mesh = stuffed(ball_grid(5, 0.25), options);
  EXPECT_EQ(mesh.points, bare.points);
  EXPECT_EQ(mesh.tetrahedra, bare.tetrahedra);
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
    const auto& [a, b, c, d] = mesh.tetrahedra[n];
    const Vec3 centroid = (mesh.points[a] + mesh.points[b] + mesh.points[c] + mesh.points[d]) / 4;
    ASSERT_EQ(mesh.material[n], norm(centroid) < 3 ? 1 : 0);
  }
  options.grade = 3;
  const tetrahedra::TetMesh graded = stuffed(ball_grid(5, 0.25), options);
  EXPECT_EQ(interface_of(graded).size(), interface_of(mesh).size());
}

TEST(StuffingInterface, WhatCrossesTheBoundaryHasNoGap) {
  const volume::Grid grid = ball_grid(5, 0.25);
  const Vec3 center{4, 1, 0};
  for (const unsigned grade : {0U, 2U}) {
    stuffing::StuffingOptions options{{}, 0.4, grade};
    const tetrahedra::TetMesh bare = stuffed(grid, options);
    options.materials = in_ball(center, 3);
    options.follow_interface = true;
    stuffing::StuffingReport report;
    const tetrahedra::TetMesh mesh = stuffed(grid, options, 2, &report);
    EXPECT_EQ(boundary_triangles(mesh), boundary_triangles(bare));
    EXPECT_NEAR(tetrahedra::volume(mesh), tetrahedra::volume(bare),
                1e-11 * tetrahedra::volume(bare));
    EXPECT_GT(report.interface_kept, 0U);
    // Both balls' lens: pi (R + r - d)^2 (d^2 + 2 d (r + R) - 3 (r - R)^2) / (12 d).
    const double d = norm(center - Vec3{0.13, -0.21, 0.07});
    const double lens = pi * (8 - d) * (8 - d) * (d * d + 16 * d - 12) / (12 * d);
    EXPECT_NEAR(volumes(mesh).at(1), lens, 0.02 * lens);
  }
}

TEST(StuffingInterface, AnyMaterialsKeepTheBounds) {
  // Cubes and noise of two to four materials, in a solid of waves.
  std::uint64_t cuts = 0, warped = 0, kept = 0;
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    std::mt19937 random(seed);
    const volume::GridInfo info = turned_axes(seed);
    const volume::Grid grid = sample(info, {-8, 0, 0}, {7, 7, 9}, [&](int i, int j, int k) {
      return 0.7 + 0.5 * std::sin(i * 0.5 + seed) * std::cos(j * 0.6) * std::sin(k * 0.4 + 1);
    });
    const std::int32_t count = 2 + static_cast<std::int32_t>(seed % 3);
    const double width = 0.5 + 0.37 * static_cast<double>(seed >> 2);
    stuffing::StuffingOptions options{{}, 0.6, seed % 2};
    const tetrahedra::TetMesh bare = stuffed(grid, options);
    options.materials = [=] {
      return [=](const Vec3& place) -> std::int32_t {
        std::uint32_t hash = seed;
        for (int a = 0; a < 3; ++a)
          hash = (hash ^ static_cast<std::uint32_t>(std::lround(place[a] / width) + 1000)) *
                 2654435761U;
        return static_cast<std::int32_t>((hash >> 16) % static_cast<std::uint32_t>(count));
      };
    };
    options.follow_interface = true;
    stuffing::StuffingReport report;
    const tetrahedra::TetMesh mesh = stuffed(grid, options, 1, &report),
                              two = stuffed(grid, options, 2);
    EXPECT_EQ(mesh.points, two.points);
    EXPECT_EQ(mesh.tetrahedra, two.tetrahedra);
    EXPECT_EQ(mesh.material, two.material);
    EXPECT_EQ(boundary_triangles(mesh), boundary_triangles(bare));
    EXPECT_NEAR(tetrahedra::volume(mesh), tetrahedra::volume(bare),
                1e-10 * tetrahedra::volume(bare));
    cuts += report.interface_cuts;
    warped += report.interface_warped;
    kept += report.interface_kept;
  }
  EXPECT_GT(cuts, 1000U);
  EXPECT_GT(warped, 1000U);
  EXPECT_GT(kept, 1000U);
}

/// If an interface runs close to the boundary, corners of a tetrahedron move onto both surfaces. A
/// tetrahedron with four moved corners could have any shape.
TEST(StuffingInterface, EachTetrahedronKeepsAnUnmovedCorner) {
  std::size_t refused = 0, beside_both = 0;
  for (const double depth : {0.2, 0.5, 0.8, 1.1}) {
    const volume::Grid grid = ball_grid(3, 0.25);
    const stuffing::MaterialSource source = in_ball({0.2, -0.2, 0.1}, 3 - 0.6 * depth);
    const stuffing::StuffingLattice lattice = stuffing::stuffing_lattice(grid, {}, 0.6);
    stuffing::StuffingBlocks blocks = stuffing::stuffing_blocks({}, grid, lattice);
    const stuffing::SurfacePoints surface = stuffing::warp_lattice({}, grid, lattice, blocks);
    const stuffing::BlockMaterials materials = stuffing::materials_of({}, lattice, blocks, source);
    (void)stuffing::find_interface({}, materials, blocks);
    const stuffing::MaterialInterface between =
        stuffing::follow_interface({}, lattice, blocks, surface, materials, source);
    for (const stuffing::InterfacePoint& point : between.points) {
      refused += point.refused ? 1 : 0;
      if (!point.warped())
        continue;
      std::array<bool, stuffing::bcc::directions> moved{};
      bool beside_boundary = false;
      for (unsigned d = 0; d < stuffing::bcc::directions; ++d) {
        const stuffing::PlaceInBlock at =
            stuffing::neighbour(blocks[point.block], point.word, point.bit, d);
        const stuffing::StuffingBlock& there = blocks[at.block];
        const bool onto_boundary = there.surface.contains(at.word, at.bit) &&
                                   surface.points[there.surface_point(at.word, at.bit)].warped();
        moved[d] =
            onto_boundary || (there.interface.contains(at.word, at.bit) &&
                              between.points[there.interface_point(at.word, at.bit)].warped());
        beside_boundary = beside_boundary || onto_boundary;
      }
      beside_both += beside_boundary ? 1 : 0;
      for (const auto& [a, b, c] : stuffing::bcc::link.faces)
        EXPECT_FALSE(moved[a] && moved[b] && moved[c]) << depth;
    }
  }
  EXPECT_GT(refused, 10U);
  EXPECT_GT(beside_both, 10U);
}

} // namespace
} // namespace gewebe::test
