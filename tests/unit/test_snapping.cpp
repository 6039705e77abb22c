#include "surface/snapping.h"

#include "base/error.h"
#include "mesh/self_intersections.h"
#include "tests/unit/larger.h"
#include "tests/unit/surface_scenes.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <map>
#include <set>
#include <string>

namespace gewebe::test {
namespace {

using namespace scenes;
using Place = surface::SnapOptions::Place;

constexpr std::array<double, 7> epsilons{0, 0.05, 0.15, 0.25, 0.35, 0.45, 0.5};

/// Snaps one scene at every epsilon; each mesh must be sound and of the same topology.
void check_scene(const volume::Grid& grid, const std::string& name) {
  const surface::IsoSurface surface = surface::marching_cubes({}, grid);
  const mesh::MeshReport before = mesh::examine_mesh(surface.mesh);
  for (const double epsilon : epsilons) {
    const surface::SnapResult result = surface::snap({}, surface, {epsilon, Place::mean, true});
    const mesh::MeshReport after = mesh::examine_mesh(result.mesh);
    EXPECT_TRUE(keeps_topology(before, after)) << name << ", epsilon " << epsilon;
    EXPECT_EQ(result.report.points_after, after.points);
    EXPECT_EQ(result.report.triangles_after, after.triangles);
    EXPECT_EQ(result.report.points_before, before.points);
    EXPECT_EQ(result.report.triangles_before, before.triangles);
    EXPECT_EQ(result.report.zero_area, after.zero_area_faces);
    // With points in corners more faces are flat; what edges can be flipped takes them away.
    const surface::SnapResult corner = surface::snap({}, surface, {epsilon, Place::corner, true});
    EXPECT_TRUE(keeps_topology(before, mesh::examine_mesh(corner.mesh)))
        << name << ", corner " << epsilon;
    EXPECT_EQ(corner.mesh.triangles.size(), result.mesh.triangles.size());
    EXPECT_LE(corner.report.zero_area, result.report.zero_area + 1)
        << name << ", corner " << epsilon;
  }
}

/// No face may cut another; answers how many corners had to be kept for that.
std::uint64_t check_cuts(const volume::Grid& grid, const std::string& name) {
  const surface::IsoSurface surface = surface::marching_cubes({}, grid);
  const mesh::MeshReport before = mesh::examine_mesh(surface.mesh);
  std::uint64_t kept = 0;
  for (const double epsilon : {0.05, 0.15, 0.3, 0.5})
    for (const Place place : {Place::mean, Place::corner}) {
      const surface::SnapResult result = surface::snap({}, surface, {epsilon, place});
      EXPECT_EQ(mesh::self_intersections({}, result.mesh).pairs, 0U) << name << ' ' << epsilon;
      EXPECT_EQ(result.report.cutting_faces, 0U);
      EXPECT_TRUE(keeps_topology(before, mesh::examine_mesh(result.mesh)))
          << name << ' ' << epsilon;
      kept += result.report.kept_corners;
      if (result.report.kept_corners == 0) {
        const surface::SnapResult unchecked = surface::snap({}, surface, {epsilon, place, true});
        EXPECT_TRUE(unchecked.mesh.points == result.mesh.points &&
                    unchecked.mesh.triangles == result.mesh.triangles);
      }
    }
  return kept;
}

TEST(Snapping, NoFaceCutsAnother) {
  std::uint64_t kept = 0;
  for (std::uint32_t seed = 0; seed < 3; ++seed) {
    check_cuts(metaballs(24, seed), "metaballs " + std::to_string(seed));
    kept += check_cuts(noise(10, seed), "noise " + std::to_string(seed));
  }
  // A shell of half a voxel, which both of its sides may snap across.
  kept += check_cuts(sample({}, {-12, -12, -12}, {12, 12, 12},
                            [](int i, int j, int k) {
                              return 0.5 + 0.6 - std::abs(std::sqrt(i * i + j * j + k * k) - 9.3);
                            }),
                     "shell");
  EXPECT_GT(kept, 100U);
}

TEST(Snapping, KeepsTopologyOfMetaballs) {
  for (std::uint32_t seed = 0; seed < 10; ++seed)
    check_scene(metaballs(16 + 4 * static_cast<int>(seed % 4), seed),
                "metaballs " + std::to_string(seed));
}

TEST(Snapping, KeepsTopologyOfWhiteNoise) {
  for (std::uint32_t seed = 0; seed < 20; ++seed)
    check_scene(noise(12, seed), "noise " + std::to_string(seed));
}

TEST(Snapping, KeepsTopologyOfQuantisedNoise) {
  for (std::uint32_t seed = 0; seed < 20; ++seed)
    check_scene(noise(12, 1000 + seed, 2 + static_cast<int>(seed % 7)),
                "quantised noise " + std::to_string(seed));
}

TEST(Snapping, NaiveSnappingBreaksTheMesh) {
  // Negative control of the three tests above: the same check fails for the report's method.
  const auto broken = [](const volume::Grid& grid, double epsilon) {
    const surface::IsoSurface surface = surface::marching_cubes({}, grid);
    return !keeps_topology(mesh::examine_mesh(surface.mesh),
                           mesh::examine_mesh(snap_naively(surface, epsilon)));
  };
  int noises = 0, balls = 0;
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    noises += broken(noise(12, seed), 0.15) ? 1 : 0;
    balls += broken(metaballs(32, seed), 0.45) ? 1 : 0;
  }
  EXPECT_EQ(noises, 20);
  EXPECT_GT(balls, 0); // few, because the table's diagonals avoid fins
}

TEST(Snapping, EpsilonZeroJoinsPointsOnACorner) {
  // A corner with the isovalue itself: its neighbours' crossings all lie on it.
  volume::GridInfo info;
  info.isovalue = 0.5;
  const volume::Grid grid = sample(info, {0, 0, 0}, {8, 8, 8}, [](int i, int j, int k) {
    return i == 4 && j == 4 && k == 4 ? 0.5 : i + j + k < 12 ? 1.0 : 0.0;
  });
  const surface::IsoSurface surface = surface::marching_cubes({}, grid);
  const surface::SnapResult result = surface::snap({}, surface, {.epsilon = 0});
  std::set<std::array<double, 3>> places;
  for (const Vec3& p : result.mesh.points)
    EXPECT_TRUE(places.insert({p.x, p.y, p.z}).second) << "two points at one place";
  EXPECT_LT(result.mesh.points.size(), surface.mesh.points.size());
  EXPECT_EQ(result.report.zero_area, 0U);
}

TEST(Snapping, EpsilonZeroLeavesAGenericMeshAlone) {
  const surface::IsoSurface surface = surface::marching_cubes({}, metaballs(24, 2));
  const surface::SnapResult result = surface::snap({}, surface, {.epsilon = 0});
  EXPECT_EQ(result.mesh.points, surface.mesh.points);
  EXPECT_EQ(result.mesh.triangles, surface.mesh.triangles);
}

TEST(Snapping, ReducesLinearlyWithEpsilon) {
  // Report, figure 3-3: the rate is almost proportional to epsilon, about 0.887 epsilon.
  double points = 0, points_left = 0, triangles = 0, triangles_left = 0;
  for (std::uint32_t seed = 0; seed < 6; ++seed) {
    const surface::IsoSurface surface = surface::marching_cubes({}, metaballs(48, seed));
    const surface::SnapReport report = surface::snap({}, surface, {.epsilon = 0.15}).report;
    points += static_cast<double>(report.points_before);
    points_left += static_cast<double>(report.points_after);
    triangles += static_cast<double>(report.triangles_before);
    triangles_left += static_cast<double>(report.triangles_after);
  }
  EXPECT_NEAR(1 - points_left / points, 0.887 * 0.15, 0.012);
  EXPECT_NEAR(1 - triangles_left / triangles, 0.887 * 0.15, 0.012);
}

TEST(Snapping, PointsStayNear) {
  const surface::IsoSurface surface = surface::marching_cubes({}, metaballs(40, 4));
  const std::vector<Ball> balls = five_balls(40, 4);
  const auto worst = [&](const surface::SnapOptions& options) {
    double largest = 0;
    for (const Vec3& p : surface::snap({}, surface, options).mesh.points)
      largest = test::larger(largest, std::abs(scenes::density(balls, p) - 0.5));
    return largest;
  };
  const double unsnapped = worst({.epsilon = 0});
  EXPECT_LT(worst({0.15, Place::mean}), 2 * unsnapped);
  EXPECT_GT(worst({0.15, Place::corner}), 2 * worst({0.15, Place::mean})); // the report's steps
}

TEST(Snapping, MergedPointsStandAtTheWeightedMeanOfTheirCrossings) {
  std::size_t merged = 0;
  double off = 0, off_unweighted = 0;
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const surface::IsoSurface surface = surface::marching_cubes({}, metaballs(32, seed, 0.5));
    const std::vector<surface::EdgeCrossing> crossings = surface::edge_crossings(surface);
    for (const double epsilon : {0.15, 0.3}) {
      const surface::SnapResult result = surface::snap({}, surface, {epsilon, Place::mean});
      if (result.report.refused != 0 || result.report.fins != 0)
        continue; // else each cluster is one point
      struct Cluster {
        Vec3 weighted, plain;
        double weights = 0;
        std::size_t count = 0;
      };
      std::vector<Cluster> clusters; // in the order of their first points
      std::map<Int3, std::size_t> at;
      for (const surface::EdgeCrossing& c : crossings) {
        const bool low = c.fraction <= epsilon, high = 1 - c.fraction <= epsilon;
        std::size_t number = clusters.size();
        if (low || high) {
          Int3 corner = c.corner;
          corner[static_cast<std::size_t>(c.axis)] += low ? 0 : 1;
          number = at.emplace(corner, number).first->second;
        }
        if (number == clusters.size())
          clusters.emplace_back();
        const double weight = 1 - 1.5 * std::min(c.fraction, 1 - c.fraction);
        Cluster& cluster = clusters[number];
        cluster.weighted += weight * surface::index_position(c);
        cluster.plain += surface::index_position(c);
        cluster.weights += weight;
        ++cluster.count;
      }
      ASSERT_EQ(result.mesh.points.size(), clusters.size());
      for (std::size_t n = 0; n < clusters.size(); ++n) {
        const Cluster& c = clusters[n];
        const Vec3 found = surface.transform.to_index(result.mesh.points[n]);
        off = test::larger(off, norm(found - c.weighted / c.weights));
        off_unweighted =
            test::larger(off_unweighted, norm(found - c.plain / static_cast<double>(c.count)));
        merged += c.count > 1 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(merged, 2000U);
  EXPECT_LT(off, 1e-6);
  EXPECT_GT(off_unweighted, 1e-2); // the weights are about something
}

TEST(Snapping, CornerPlacesPointsOnTheLattice) {
  const surface::IsoSurface surface = surface::marching_cubes({}, metaballs(24, 7));
  const auto on_lattice = [&](Place place) {
    std::size_t count = 0;
    for (const Vec3& p : surface::snap({}, surface, {0.5, place}).mesh.points)
      count += p.x == std::floor(p.x) && p.y == std::floor(p.y) && p.z == std::floor(p.z) ? 1 : 0;
    return count;
  };
  EXPECT_EQ(on_lattice(Place::corner),
            surface::snap({}, surface, {0.5, Place::corner}).mesh.points.size());
  EXPECT_LT(on_lattice(Place::mean), 20U);
}

TEST(Snapping, TinyComponentsSurvive) {
  // One voxel just above the isovalue: all six crossings in one cluster; a tetrahedron must remain.
  const surface::IsoSurface surface = surface::marching_cubes(
      {}, sample({}, {3, 3, 3}, {3, 3, 3}, [](int, int, int) { return 0.5001; }));
  const surface::SnapResult result =
      surface::snap({}, surface, {.epsilon = 0.15, .place = Place::corner});
  EXPECT_EQ(result.mesh.points.size(), 4U);
  EXPECT_EQ(result.mesh.triangles.size(), 4U);
  EXPECT_EQ(result.report.refused, 6U);
  EXPECT_EQ(result.report.zero_area, 0U); // not all in the corner: each at its own crossing
  EXPECT_EQ(mesh::examine_mesh(result.mesh).zero_area_faces, 0U);
  EXPECT_EQ(result.report.corners, 1U);
}

TEST(Snapping, CornerLeavesNoFlatFaces) {
  // Three corners of the lattice in one line made faces without area (report, section 3.1.4).
  std::uint64_t without_flips = 0;
  for (const double epsilon : {0.15, 0.25, 0.5})
    for (std::uint32_t seed = 0; seed < 6; ++seed) {
      const surface::IsoSurface surface = surface::marching_cubes({}, metaballs(48, seed));
      const mesh::MeshReport before = mesh::examine_mesh(surface.mesh);
      const surface::SnapResult result = surface::snap({}, surface, {epsilon, Place::corner, true});
      const mesh::MeshReport after = mesh::examine_mesh(result.mesh);
      EXPECT_EQ(after.zero_area_faces, 0U) << epsilon << ' ' << seed;
      EXPECT_EQ(result.report.zero_area, 0U);
      EXPECT_TRUE(keeps_topology(before, after));
      EXPECT_NEAR(signed_volume(result.mesh), signed_volume(surface.mesh),
                  0.05 * signed_volume(surface.mesh));
      TriangleMesh unflipped = result.mesh; // the faces are those of Place::mean
      unflipped.triangles = surface::snap({}, surface, {epsilon, Place::mean, true}).mesh.triangles;
      without_flips += mesh::examine_mesh(unflipped).zero_area_faces;
    }
  EXPECT_GT(without_flips, 20U);
}

TEST(Snapping, EmptySurface) {
  const surface::SnapResult result = surface::snap({}, surface::IsoSurface{}, {});
  EXPECT_TRUE(result.mesh.points.empty());
  EXPECT_EQ(result.report.points_before, 0U);
}

TEST(Snapping, RefusesEpsilonOutOfRange) {
  const surface::IsoSurface surface = surface::marching_cubes({}, metaballs(16, 1));
  for (const double epsilon : {-0.01, 0.51, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(surface::snap({}, surface, {.epsilon = epsilon}), Error);
  Context small;
  small.max_memory = 1000;
  EXPECT_THROW(surface::snap(small, surface, {}), Error);
}

} // namespace
} // namespace gewebe::test
