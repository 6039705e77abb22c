// What snapping at epsilon 0.5 costs in error and gives in quality, as the manual promises.

#include "antialiasing/coverage.h"
#include "formats/mesh/mesh_file.h"
#include "mesh/quality.h"
#include "mesh/self_intersections.h"
#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/surface_scenes.h"
#include "volume/lattice.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace gewebe::test {
namespace {

using namespace scenes;
using Place = surface::SnapOptions::Place;

/// Mean distances, to first order, from the exact isosurface of the balls' density.
struct Errors {
  double points = 0, centroids = 0;
};

Errors errors_of(const TriangleMesh& mesh, const std::vector<Ball>& balls) {
  const auto distance = [&](const Vec3& p) {
    constexpr double h = 1e-4;
    Vec3 gradient;
    for (int a = 0; a < 3; ++a) {
      Vec3 low = p, high = p;
      low[a] -= h;
      high[a] += h;
      gradient[a] = (scenes::density(balls, high) - scenes::density(balls, low)) / (2 * h);
    }
    return std::abs(scenes::density(balls, p) - 0.5) / norm(gradient);
  };
  Errors errors;
  for (const Vec3& p : mesh.points)
    errors.points += distance(p) / static_cast<double>(mesh.points.size());
  for (const auto& [a, b, c] : mesh.triangles)
    errors.centroids += distance((mesh.points[a] + mesh.points[b] + mesh.points[c]) / 3) /
                        static_cast<double>(mesh.triangles.size());
  return errors;
}

TEST(SnappingBounds, ErrorOfMetaballs) {
  Errors plain, mean, corner;
  for (std::uint32_t seed = 0; seed < 8; ++seed) {
    const std::vector<Ball> balls = five_balls(64, seed);
    const surface::IsoSurface surface = surface::marching_cubes({}, metaballs(64, seed));
    const auto add = [&](Errors& sum, const surface::SnapOptions& options) {
      const Errors errors = errors_of(surface::snap({}, surface, options).mesh, balls);
      sum.points += errors.points;
      sum.centroids += errors.centroids;
    };
    add(plain, {0, Place::mean});
    add(mean, {0.5, Place::mean});
    add(corner, {0.5, Place::corner});
  }
  EXPECT_LT(mean.points, 1.2 * plain.points);
  EXPECT_LT(mean.centroids, 1.6 * plain.centroids);
  EXPECT_GT(corner.points, 10 * plain.points); // the negative control: the report's steps
  EXPECT_GT(corner.centroids, 3 * plain.centroids);
}

TEST(SnappingBounds, AnglesOfMetaballs) {
  double one_percent = 0;
  constexpr std::uint32_t count = 12;
  for (std::uint32_t seed = 0; seed < count; ++seed) {
    const surface::IsoSurface surface = surface::marching_cubes({}, metaballs(64, seed));
    const surface::SnapResult snapped = surface::snap({}, surface, {0.5, Place::mean});
    const mesh::MeshQuality quality = mesh::mesh_quality(snapped.mesh);
    one_percent += quality.angle_1_percent / count;
    EXPECT_EQ(snapped.report.zero_area, 0U) << seed;
    EXPECT_EQ(mesh::self_intersections({}, snapped.mesh).pairs, 0U) << seed;
    EXPECT_LT(mesh::mesh_quality(surface.mesh).angle_1_percent, 3) << seed; // and without
  }
  RecordProperty("angle_1_percent", std::to_string(one_percent));
  EXPECT_GT(one_percent, 31);
}

/// The organ of shared data as a volume of exact fractions, or nothing.
std::optional<volume::Grid> organ(const std::string& file, const char* unit, int dim) {
  const std::string path = test::shared_folder() + "/data/" + file;
  if (!std::filesystem::exists(path))
    return std::nullopt;
  formats::Input input(path);
  formats::MeshReadOptions options;
  options.kind = file.ends_with("obj") ? formats::Kind::obj : formats::Kind::stl;
  options.unit = unit;
  const TriangleMesh mesh = formats::read_mesh(input, options);
  antialiasing::CoverageReport report;
  return antialiasing::exact_coverage({}, mesh, volume::lattice_for_dim(bounding_box(mesh), dim),
                                      voxelization::OpenMesh::refuse, &report);
}

void check_organ(const volume::Grid& grid) {
  const surface::SnapResult snapped =
      surface::snap({}, surface::marching_cubes({}, grid), {0.5, Place::mean});
  EXPECT_TRUE(is_sound(mesh::examine_mesh(snapped.mesh)));
  EXPECT_EQ(snapped.report.zero_area, 0U);
  EXPECT_EQ(mesh::self_intersections({}, snapped.mesh).pairs, 0U);
  const mesh::MeshQuality quality = mesh::mesh_quality(snapped.mesh);
  EXPECT_GT(quality.angle_1_percent, 30);
  EXPECT_LT(quality.share_below_10, 1e-3);
  // The negative control: without the flips corners leave flat faces that lie on each other.
  TriangleMesh unflipped =
      surface::snap({}, surface::marching_cubes({}, grid), {0.25, Place::corner}).mesh;
  const std::uint64_t flipped = mesh::self_intersections({}, unflipped).pairs;
  unflipped.triangles =
      surface::snap({}, surface::marching_cubes({}, grid), {0.25, Place::mean}).mesh.triangles;
  EXPECT_GT(mesh::self_intersections({}, unflipped).pairs, flipped);
}

TEST(SnappingBounds, Liver) {
  const std::optional<volume::Grid> grid = organ("sofa_liver_smooth.obj", "cm", 96);
  if (!grid)
    GTEST_SKIP() << "no sofa_liver_smooth.obj";
  check_organ(*grid);
}

TEST(SnappingBounds, Colon) {
  const std::optional<volume::Grid> grid = organ("gca90_large_intestine_20k.stl", "mm", 128);
  if (!grid)
    GTEST_SKIP() << "no gca90_large_intestine_20k.stl";
  check_organ(*grid);
}

} // namespace
} // namespace gewebe::test
