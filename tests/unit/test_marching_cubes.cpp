#include "surface/marching_cubes.h"

#include "base/error.h"
#include "tests/unit/surface_scenes.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

namespace gewebe::test {
namespace {

using namespace scenes;

bool same_mesh(const TriangleMesh& a, const TriangleMesh& b) {
  return a.points == b.points && a.triangles == b.triangles;
}

/// Linear in the distance, so that crossings are exact along rays: a ball of radius r at `center`.
volume::Grid density_ball(const volume::GridInfo& info, double radius, const Vec3& center, int n,
                          bool prune = true) {
  return sample(
      info, {-n, -n, -n}, {n, n, n},
      [&](int i, int j, int k) {
        const Vec3 p = info.transform.to_world(
            {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
        return std::clamp(0.5 + radius - norm(p - center), 0.0, 100.0);
      },
      prune);
}

TEST(MarchingCubes, SphereConvergesWithOrderTwo) {
  const double volume = 4.0 / 3 * std::numbers::pi, area = 4 * std::numbers::pi;
  double last_volume = 0, last_area = 0;
  for (const int n : {8, 16, 32}) {
    volume::GridInfo info;
    info.transform = volume::uniform_transform(1.0 / n);
    const surface::IsoSurface surface =
        surface::marching_cubes({}, density_ball(info, 1, {0.013, -0.021, 0.007}, n + 6));
    const mesh::MeshReport report = mesh::examine_mesh(surface.mesh);
    ASSERT_TRUE(is_sound(report));
    EXPECT_TRUE(report.outward());
    EXPECT_EQ(report.euler, 2);
    EXPECT_EQ(report.components, 1U);
    const std::vector<surface::EdgeCrossing> crossings = surface::edge_crossings(surface);
    ASSERT_EQ(crossings.size(), surface.mesh.points.size());
    for (std::size_t p = 0; p < crossings.size(); ++p)
      EXPECT_EQ(surface.mesh.points[p],
                surface.transform.to_world(surface::index_position(crossings[p])));
    const double volume_error = std::abs(report.volume - volume) / volume,
                 area_error = std::abs(report.area - area) / area;
    EXPECT_LT(volume_error, 0.65 / (n * n));
    EXPECT_LT(area_error, 0.65 / (n * n));
    if (n > 8) {
      EXPECT_GT(last_volume / volume_error, 3.3);
      EXPECT_GT(last_area / area_error, 3.3);
    }
    last_volume = volume_error;
    last_area = area_error;
  }
}

TEST(MarchingCubes, PlaneIsExact) {
  // d = 3x + 2y - 5z + 1.25 in index space: crossings are where it equals the isovalue.
  const auto plane = [](const Vec3& p) { return 3 * p.x + 2 * p.y - 5 * p.z + 1.25; };
  const volume::Grid grid = sample({}, {-9, -9, -9}, {10, 10, 10}, [&](int i, int j, int k) {
    return plane({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
  });
  const surface::IsoSurface surface = surface::marching_cubes({}, grid);
  ASSERT_TRUE(is_sound(mesh::examine_mesh(surface.mesh)));
  std::size_t inner = 0;
  for (const Vec3& p : surface.mesh.points)
    if (std::abs(p.x) < 8.9 && std::abs(p.y) < 8.9 && std::abs(p.z) < 8.9) {
      ++inner;
      EXPECT_LT(std::abs(plane(p) - 0.5), 1e-13);
    }
  EXPECT_GT(inner, 300U);
}

TEST(MarchingCubes, CrossingsLieOnCrossedEdges) {
  const volume::Grid grid = metaballs(24, 3);
  const surface::IsoSurface surface = surface::marching_cubes({}, grid);
  volume::GridAccessor values(grid);
  const std::vector<surface::EdgeCrossing> crossings = surface::edge_crossings(surface);
  ASSERT_EQ(crossings.size(), surface.mesh.points.size());
  for (std::size_t p = 0; p < crossings.size(); ++p) {
    const surface::EdgeCrossing& c = crossings[p];
    Int3 end = c.corner;
    ++end[static_cast<std::size_t>(c.axis)];
    const double a = values.value(c.corner), b = values.value(end);
    EXPECT_NE(a > 0.5, b > 0.5);
    EXPECT_NEAR(a + c.fraction * (b - a), 0.5, 1e-15);
    EXPECT_EQ(grid.info().transform.to_world(surface::index_position(c)), surface.mesh.points[p]);
  }
}

TEST(MarchingCubes, OneVoxelIsAnOctahedronWherever) {
  for (int n = 0; n < 27; ++n) {
    const Int3 p{7 + n % 3, -9 + n / 3 % 3, 127 + n / 9}; // in, beside and across leaf borders
    const surface::IsoSurface surface =
        surface::marching_cubes({}, sample({}, p, p, [](int, int, int) { return 1; }));
    const mesh::MeshReport report = mesh::examine_mesh(surface.mesh);
    EXPECT_TRUE(is_sound(report) && report.outward());
    EXPECT_EQ(report.points, 6U);
    EXPECT_EQ(report.triangles, 8U);
    EXPECT_NEAR(report.volume, 1.0 / 6, 1e-12);
    EXPECT_EQ(surface.active_cells, 8U);
  }
}

TEST(MarchingCubes, TilesGiveTheSameBytesAsLeaves) {
  const auto cube = [](int i, int j, int k) {
    return i >= 8 && i < 24 && j >= -8 && j < 16 && k >= 0 && k < 8 ? 2.0 : 0.0;
  };
  const volume::Grid pruned = sample({}, {0, -16, -8}, {31, 31, 15}, cube, true);
  const volume::Grid plain = sample({}, {0, -16, -8}, {31, 31, 15}, cube, false);
  ASSERT_GT(pruned.tiles().size(), 0U);
  ASSERT_EQ(plain.tiles().size(), 0U);
  const surface::IsoSurface a = surface::marching_cubes({}, pruned),
                            b = surface::marching_cubes({}, plain);
  EXPECT_TRUE(same_mesh(a.mesh, b.mesh));
  EXPECT_TRUE(is_sound(mesh::examine_mesh(a.mesh)));
  EXPECT_EQ(a.mesh.points.size(), 2U * (16 * 24 + 24 * 8 + 16 * 8));
}

TEST(MarchingCubes, LargeTilesMeetLeavesTilesAndBackground) {
  // A tile of 128³, on it a leaf, beside it a tile of 8³, and a hole in none: one closed body.
  volume::GridBuilder builder({});
  builder.add_tile({{0, 0, 0}, 128, 1, true});
  builder.add_tile({{128, 64, 64}, 8, 1, true});
  const std::vector<Int3> origins{{64, 64, 128}};
  for (const volume::LeafRef& leaf : builder.add_leaves({}, origins))
    for (int n = 0; n < volume::leaf_voxels; ++n)
      leaf.values[n] = (n & 7) < 4 ? 1.0F : 0.0F;
  const surface::IsoSurface surface = surface::marching_cubes({}, builder.finish());
  const mesh::MeshReport report = mesh::examine_mesh(surface.mesh);
  EXPECT_TRUE(is_sound(report) && report.outward());
  EXPECT_EQ(report.euler, 2);
  EXPECT_EQ(report.components, 1U);
  EXPECT_EQ(report.points, 6U * 128 * 128 + 4 * 8 * 8 + 4 * 8 * 4);
}

TEST(MarchingCubes, TileOfAnotherValueCountsInInterpolation) {
  // Outside, but not background: the crossing lies elsewhere.
  volume::GridBuilder builder({});
  builder.add_tile({{0, 0, 0}, 8, 1, true});
  builder.add_tile({{8, 0, 0}, 8, 0.25F, true});
  const surface::IsoSurface surface = surface::marching_cubes({}, builder.finish());
  EXPECT_TRUE(is_sound(mesh::examine_mesh(surface.mesh)));
  std::size_t found = 0;
  for (const surface::EdgeCrossing& c : surface::edge_crossings(surface))
    if (c.axis == 0 && c.corner[0] == 7) {
      EXPECT_DOUBLE_EQ(c.fraction, 0.5 / 0.75);
      ++found;
    }
  EXPECT_EQ(found, 64U);
}

TEST(MarchingCubes, LargestTileWithoutIteratingItsVolume) {
  volume::GridBuilder builder({});
  builder.add_tile({{0, 0, 0}, 4096, 1, true});
  builder.add_tile({{4096, 0, 0}, 4096, 1, true});
  Context context;
  context.max_memory = 1 << 28;
  EXPECT_THROW(surface::marching_cubes(context, builder.finish()),
               Error); // 1.7e8 points: refused, not made
}

TEST(MarchingCubes, NestedShellsAndCavities) {
  const volume::Grid grid = sample({}, {-15, -15, -15}, {15, 15, 15}, [](int i, int j, int k) {
    const double r = std::sqrt(i * i + j * j + k * k);
    return r < 3.2 ? 1.0 : r < 7.1 ? 0.0 : r < 12.3 ? 1.0 : 0.0;
  });
  const mesh::MeshReport report = mesh::examine_mesh(surface::marching_cubes({}, grid).mesh);
  EXPECT_TRUE(is_sound(report) && report.outward());
  EXPECT_EQ(report.components, 3U);
  EXPECT_EQ(report.euler, 6);
}

TEST(MarchingCubes, BackgroundInsideIsClosedToo) {
  volume::GridInfo info;
  info.background = 1;
  const volume::Grid grid = sample(info, {0, 0, 0}, {9, 9, 9}, [](int, int, int) { return 0; });
  const mesh::MeshReport report = mesh::examine_mesh(surface::marching_cubes({}, grid).mesh);
  EXPECT_TRUE(is_sound(report));
  EXPECT_LT(report.volume, 0);
  EXPECT_FALSE(report.outward());
}

TEST(MarchingCubes, LevelSetIsInsideBelowZero) {
  volume::GridInfo info;
  info.level_set = true;
  info.background = 3;
  const volume::Grid grid = sample(info, {-10, -10, -10}, {10, 10, 10}, [](int i, int j, int k) {
    return std::clamp(std::sqrt(i * i + j * j + k * k) - 6.3, -3.0, 3.0);
  });
  const surface::IsoSurface surface = surface::marching_cubes({}, grid);
  const mesh::MeshReport report = mesh::examine_mesh(surface.mesh);
  EXPECT_TRUE(is_sound(report) && report.outward());
  EXPECT_NEAR(report.volume, 4.0 / 3 * std::numbers::pi * 6.3 * 6.3 * 6.3, 20);
}

TEST(MarchingCubes, MirroredAndShearedTransformsFaceOutward) {
  for (const double mirror : {1.0, -1.0}) {
    volume::GridInfo info;
    info.transform.m = {0.5 * mirror, 0.1, 0, 4, 0, 0, 0.7, -2, 0.05, 0.9, 0, 1};
    const volume::Grid grid = sample(info, {-9, -9, -9}, {9, 9, 9}, [](int i, int j, int k) {
      return 7 - std::sqrt(i * i + j * j + k * k);
    });
    const mesh::MeshReport report = mesh::examine_mesh(surface::marching_cubes({}, grid).mesh);
    EXPECT_TRUE(is_sound(report) && report.outward()) << mirror;
    EXPECT_NEAR(
        report.volume,
        4.0 / 3 * std::numbers::pi * 6.5 * 6.5 * 6.5 * std::abs(info.transform.determinant()), 8);
  }
}

TEST(MarchingCubes, EqualIsOutside) {
  const volume::Grid grid = sample({}, {0, 0, 0}, {7, 7, 7}, [](int, int, int) { return 0.5; });
  EXPECT_TRUE(surface::marching_cubes({}, grid).mesh.triangles.empty());
  EXPECT_FALSE(surface::marching_cubes({}, grid, 0.4999999).mesh.triangles.empty());
  EXPECT_TRUE(
      surface::marching_cubes({}, grid, 0.5 + 1e-12).mesh.triangles.empty()); // no float between
  EXPECT_FALSE(surface::marching_cubes({}, grid, 0.5 - 1e-12).mesh.triangles.empty());
}

TEST(MarchingCubes, EmptyGridHasNoSurface) {
  EXPECT_TRUE(surface::marching_cubes({}, volume::Grid()).mesh.points.empty());
  EXPECT_TRUE(surface::marching_cubes({}, metaballs(16, 1), 100).mesh.points.empty());
}

TEST(MarchingCubes, NoiseIsClosedManifoldOriented) {
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    const surface::IsoSurface surface =
        surface::marching_cubes({}, noise(12, seed, static_cast<int>(seed % 3) * 4));
    const mesh::MeshReport report = mesh::examine_mesh(surface.mesh);
    EXPECT_TRUE(is_sound(report)) << seed;
    EXPECT_TRUE(report.outward()) << seed;
  }
}

TEST(MarchingCubes, SameBytesForAnyThreadCount) {
  const volume::Grid grid = metaballs(48, 5);
  Context one, three;
  one.threads = 1;
  three.threads = 3;
  const surface::IsoSurface a = surface::marching_cubes(one, grid),
                            b = surface::marching_cubes(three, grid);
  EXPECT_TRUE(same_mesh(a.mesh, b.mesh));
  EXPECT_EQ(a.leaves, grid.leaves().size());
  EXPECT_GT(a.leaves_visited, 0U);
  EXPECT_LT(a.leaves_visited, a.leaves);
}

TEST(MarchingCubes, RefusesWhatItCannotMesh) {
  const auto expect_error = [](const volume::Grid& grid, const std::string& part) {
    try {
      surface::marching_cubes({}, grid);
      ADD_FAILURE() << "expected: " << part;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  const auto one = [](volume::GridInfo info, const Int3& p, float value) {
    return sample(info, p, p, [&](int, int, int) { return value; });
  };
  volume::GridInfo band;
  band.band_isovalue = 0.3;
  expect_error(one(band, {0, 0, 0}, 1), "only near isovalue 0.3");
  EXPECT_NO_THROW(surface::marching_cubes({}, one(band, {0, 0, 0}, 1), 0.3));
  volume::GridInfo flat;
  flat.transform.m[0] = 0;
  expect_error(one(flat, {0, 0, 0}, 1), "singular");
  expect_error(one({}, {INT32_MAX - 20, 0, 0}, 1), "limits of 32 bits");
  expect_error(one({}, {0, INT32_MIN + 10, 0}, 1), "limits of 32 bits");
  expect_error(one({}, {0, 0, 0}, std::numeric_limits<float>::infinity()), "not finite");
  EXPECT_THROW(surface::marching_cubes({}, metaballs(16, 1), std::nan("")), Error);
  Context small;
  small.max_memory = 1000;
  EXPECT_THROW(surface::marching_cubes(small, metaballs(16, 1)), Error);
  Context stop;
  stop.cancelled = [] { return true; };
  EXPECT_THROW(surface::marching_cubes(stop, metaballs(16, 1)), Cancelled);
}

} // namespace
} // namespace gewebe::test
