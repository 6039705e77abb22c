// Densities of labels: planes, boxes and balls on all kinds of lattices.

#include "base/error.h"
#include "labels/label_density.h"
#include "mesh/check.h"
#include "surface/marching_cubes.h"
#include "tests/unit/larger.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

using namespace gewebe;

namespace {

/// The voxels whose centre (in mm along the axes from voxel (0, 0, 0)) is inside.
labels::LabelMask mask_of(const Int3& size, const Vec3& spacing,
                          const std::function<bool(const Vec3&)>& inside) {
  labels::LabelMask mask;
  mask.size = size;
  mask.transform.m = {spacing.x, 0, 0, 0, 0, spacing.y, 0, 0, 0, 0, spacing.z, 0};
  mask.bits.resize(mask.row(0, size[2]));
  for (std::int32_t k = 0; k < size[2]; ++k)
    for (std::int32_t j = 0; j < size[1]; ++j)
      for (std::int32_t i = 0; i < size[0]; ++i)
        if (inside({i * spacing.x, j * spacing.y, k * spacing.z}))
          mask.bits[mask.row(j, k) + static_cast<std::size_t>(i >> 6)] |= std::uint64_t{1}
                                                                          << (i & 63);
  return mask;
}

/// Turns a mask of axis-parallel lattice about axes, mirrors it, and moves it.
void place(labels::LabelMask& mask, double angle, bool mirrored) {
  const double c = std::cos(angle), s = std::sin(angle);
  std::array<double, 12>& m = mask.transform.m;
  const Vec3 spacing{m[0], m[5], m[10]};
  const double side = mirrored ? -1 : 1;
  // About z, then about x.
  m = {c * spacing.x,
       -s * spacing.y,
       0,
       -80,
       c * s * spacing.x,
       c * c * spacing.y,
       -s * side * spacing.z,
       120,
       s * s * spacing.x,
       s * c * spacing.y,
       c * side * spacing.z,
       40};
}

struct Solid {
  TriangleMesh mesh;
  double volume = 0;
  Vec3 centroid;
};

/// The surface at 0.5, proven closed, manifold and outward.
Solid solid_of(const volume::Grid& grid) {
  Solid solid;
  solid.mesh = surface::marching_cubes({}, grid).mesh;
  const mesh::MeshReport report = mesh::examine_mesh(solid.mesh);
  EXPECT_TRUE(report.closed() && report.manifold() && report.outward());
  Vec3 moment;
  for (const Triangle& t : solid.mesh.triangles) {
    const Vec3 &a = solid.mesh.points[t[0]], &b = solid.mesh.points[t[1]],
               &c = solid.mesh.points[t[2]];
    const double part = dot(a, cross(b, c)) / 6;
    solid.volume += part;
    moment += (a + b + c) * (part / 4);
  }
  solid.centroid = moment / solid.volume;
  return solid;
}

double ball_volume(double radius) {
  return 4.0 / 3 * std::numbers::pi * radius * radius * radius;
}

struct Deviation {
  double mean = 0, rms = 0, largest = 0;
};
Deviation deviation_of(const TriangleMesh& mesh,
                       const std::function<double(const Vec3&)>& distance) {
  Deviation d;
  for (const Vec3& p : mesh.points) {
    const double x = distance(p);
    d.mean += x;
    d.rms += x * x;
    d.largest = test::larger(d.largest, std::fabs(x));
  }
  d.mean /= static_cast<double>(mesh.points.size());
  d.rms = std::sqrt(d.rms / static_cast<double>(mesh.points.size()));
  return d;
}

} // namespace

TEST(LabelDensity, EveryCentreKeepsItsSide) {
  // Random blobs with thin parts; at the default voxel of equal spacings the centres are the
  // labels' own.
  std::uint32_t seed = 1;
  const labels::LabelMask mask = mask_of({37, 29, 23}, {1, 1, 1}, [&](const Vec3& p) {
    seed = seed * 1664525 + 1013904223;
    return (seed >> 30) == 0 || norm(p - Vec3{18, 14, 11}) < 8 || (p.x == 3 && p.y == 20);
  });
  labels::LabelDensityReport report;
  const volume::Grid grid = labels::label_density({}, mask, {}, &report);
  volume::GridAccessor value(grid);
  for (std::int32_t k = -2; k < 25; ++k)
    for (std::int32_t j = -2; j < 31; ++j)
      for (std::int32_t i = -2; i < 39; ++i)
        ASSERT_EQ(value.value({i, j, k}) > 0.5F, mask.inside({i, j, k}))
            << i << ' ' << j << ' ' << k;
  EXPECT_GT(report.voxels, 2000U);
  (void)solid_of(grid);
}

TEST(LabelDensity, BallsKeepVolumeAndPlaceOnAllLattices) {
  struct Case {
    Vec3 spacing;
    double radius, volume, rms; // tolerances: relative, mm
  };
  for (const auto& [spacing, radius, volume, rms] :
       {Case{{1, 1, 1}, 6, 0.03, 0.09}, Case{{1, 1, 1}, 12, 0.015, 0.07},
        Case{{0.8, 0.8, 2.5}, 10, 0.03, 0.2}, Case{{3, 1, 1}, 14, 0.03, 0.2},
        Case{{1, 5, 1}, 20, 0.03, 0.5}}) {
    for (const bool mirrored : {false, true}) {
      const double angle = mirrored ? 0.6 : 0;
      const auto count = [&](double s) {
        return static_cast<std::int32_t>(std::ceil(2 * radius / s)) + 7;
      };
      const Int3 size{count(spacing.x), count(spacing.y), count(spacing.z)};
      const Vec3 centre{spacing.x * (size[0] / 2.0 + 0.3), spacing.y * (size[1] / 2.0 - 0.1),
                        spacing.z * (size[2] / 2.0 + 0.2)};
      labels::LabelMask mask =
          mask_of(size, spacing, [&](const Vec3& p) { return norm(p - centre) < radius; });
      place(mask, angle, mirrored);
      const Vec3 there = mask.transform.to_world(
          {centre.x / spacing.x, centre.y / spacing.y, centre.z / spacing.z});
      labels::LabelDensityReport report;
      const volume::Grid grid = labels::label_density({}, mask, {}, &report);
      EXPECT_TRUE(grid.info().transform.is_cubic());
      EXPECT_LT(report.shear, 1e-12);
      const Solid solid = solid_of(grid);
      const double smallest = std::fmin(spacing.x, spacing.y);
      EXPECT_NEAR(grid.info().transform.voxel_size().x, smallest, 1e-12);
      EXPECT_LT(std::fabs(solid.volume / ball_volume(radius) - 1), volume) << spacing.z;
      EXPECT_LT(norm(solid.centroid - there), 0.15 * smallest);
      const Deviation d =
          deviation_of(solid.mesh, [&](const Vec3& p) { return norm(p - there) - radius; });
      EXPECT_LT(d.rms, rms) << spacing.x << ' ' << spacing.z << ' ' << radius;
      EXPECT_LT(std::fabs(d.mean), rms / 2);
    }
  }
}

TEST(LabelDensity, AnAlignedBoxKeepsItsFacesAndVolume) {
  const labels::LabelMask mask = mask_of({30, 30, 20}, {1, 1, 2}, [](const Vec3& p) {
    return p.x >= 5 && p.x <= 24 && p.y >= 5 && p.y <= 24 && p.z >= 6 && p.z <= 32;
  });
  const Solid solid = solid_of(labels::label_density({}, mask, {}));
  const Box3 box = bounding_box(solid.mesh);
  // Half a voxel beyond the outermost centres.
  EXPECT_LT(norm(box.min - Vec3{4.5, 4.5, 5}), 0.75);
  EXPECT_LT(norm(box.max - Vec3{24.5, 24.5, 33}), 0.75);
  EXPECT_NEAR(solid.volume / (20.0 * 20 * 28), 1, 0.02);
  EXPECT_LT(norm(solid.centroid - Vec3{14.5, 14.5, 19}), 0.05);
}

TEST(LabelDensity, ObliquePlanesLoseTheirStairs) {
  struct Case {
    Int3 size;
    double dz, slope, share; // rms of the deviation over that of the stairs, dz / sqrt(12)
  };
  for (const auto& [size, dz, slope, share] :
       {Case{{48, 40, 40}, 1, 0.5, 0.2}, Case{{64, 40, 24}, 1, 0.1, 0.3},
        Case{{64, 48, 16}, 5, 0.5, 0.35}}) {
    const Vec3 middle{size[0] / 2.0, size[1] / 2.0, size[2] * dz / 2};
    const auto height = [&](const Vec3& p) {
      return p.z - middle.z - slope * (p.x - middle.x) - 0.3 * slope * (p.y - middle.y);
    };
    const labels::LabelMask mask =
        mask_of(size, {1, 1, dz}, [&](const Vec3& p) { return height(p) < 0; });
    TriangleMesh mesh = solid_of(labels::label_density({}, mask, {})).mesh;
    std::erase_if(mesh.points, [&](const Vec3& p) {
      return p.x < 12 || p.x > size[0] - 13 || p.y < 12 || p.y > size[1] - 13 || p.z < 3 * dz ||
             p.z > (size[2] - 4) * dz;
    });
    ASSERT_GT(mesh.points.size(), 300U);
    const Deviation d = deviation_of(mesh, height);
    EXPECT_LT(d.rms, share * dz / std::sqrt(12)) << dz << ' ' << slope;
  }
}

TEST(LabelDensity, WhatTheEdgeCutsOffIsClosed) {
  // All of the volume, and a ball of which half lies outside.
  const labels::LabelMask all = mask_of({9, 7, 5}, {2, 2, 3}, [](const Vec3&) { return true; });
  const Solid block = solid_of(labels::label_density({}, all, {}));
  EXPECT_NEAR(block.volume / (18.0 * 14 * 15), 1, 0.04);
  const labels::LabelMask half = mask_of({40, 40, 20}, {1, 1, 1}, [](const Vec3& p) {
    return norm(p - Vec3{20, 20, 0}) < 14;
  });
  const Solid cut = solid_of(labels::label_density({}, half, {}));
  // Half a slice more than the half ball.
  EXPECT_NEAR(cut.volume / (ball_volume(14) / 2 + 0.5 * std::numbers::pi * 196), 1, 0.01);
  EXPECT_NEAR(bounding_box(cut.mesh).min.z, -0.5, 0.3);
}

TEST(LabelDensity, ASingleVoxelAndASingleSlice) {
  const labels::LabelMask one = mask_of({3, 3, 3}, {1, 1, 1}, [](const Vec3& p) {
    return p == Vec3{1, 1, 1};
  });
  EXPECT_LT(norm(solid_of(labels::label_density({}, one, {})).centroid - Vec3{1, 1, 1}), 1e-6);
  const labels::LabelMask slice = mask_of({40, 40, 1}, {1, 1, 4}, [](const Vec3& p) {
    return norm(p - Vec3{20, 20, 0}) < 15;
  });
  const Solid disc = solid_of(labels::label_density({}, slice, {}));
  EXPECT_NEAR(disc.volume / (std::numbers::pi * 225 * 4), 1, 0.35);
}

TEST(LabelDensity, InteriorsAreTiles) {
  const labels::LabelMask mask = mask_of({96, 96, 96}, {1, 1, 1}, [](const Vec3& p) {
    return norm(p - Vec3{48, 48, 48}) < 44;
  });
  labels::LabelDensityReport report;
  const volume::Grid grid = labels::label_density({}, mask, {}, &report);
  std::uint64_t voxels_of_tiles = 0;
  for (const volume::TileView& tile : grid.tiles())
    voxels_of_tiles += static_cast<std::uint64_t>(tile.dim) * static_cast<std::uint64_t>(tile.dim) *
                       static_cast<std::uint64_t>(tile.dim);
  EXPECT_GT(voxels_of_tiles, report.voxels / 3);
  EXPECT_GT(report.leaves_skipped, report.band_voxels / 512 / 2);
}

TEST(LabelDensity, ThreadsAndProcessorsGiveTheSameBytes) {
  const labels::LabelMask mask = mask_of({31, 23, 11}, {0.7, 0.9, 2}, [](const Vec3& p) {
    return norm(p - Vec3{12, 10, 12}) < 7 || std::fabs(p.x - p.z) < 2;
  });
  Context context;
  context.threads = 1;
  context.cpu = CpuLevel::baseline;
  const std::uint64_t digest = labels::label_density(context, mask, {}).digest();
  for (const auto& [threads, level] : {std::pair(5, "baseline"), {1, "avx2"}, {2, "avx512"}}) {
    context.threads = threads;
    context.cpu = cpu_level_from_name(level);
    EXPECT_EQ(labels::label_density(context, mask, {}).digest(), digest) << threads << ' ' << level;
  }
  EXPECT_NE(labels::label_density(context, mask, {.voxel = 0.8}).digest(),
            digest); // negative control
}

TEST(LabelDensity, ObliqueAxesAreRefusedAndRoundingIsNot) {
  labels::LabelMask mask = mask_of({50, 50, 50}, {1, 1, 1}, [](const Vec3& p) {
    return norm(p - Vec3{25, 25, 25}) < 10;
  });
  mask.transform.m[1] = 1e-7;
  labels::LabelDensityReport report;
  const volume::Grid grid = labels::label_density({}, mask, {}, &report);
  EXPECT_TRUE(grid.info().transform.is_cubic());
  EXPECT_GT(report.shear, 1e-6);
  EXPECT_LT(report.shear, 1e-5);
  mask.transform.m[1] = 0.2;
  EXPECT_THROW((void)labels::label_density({}, mask, {}), Error);
}

TEST(LabelDensity, SizesAreRefusedBeforeTheWork) {
  const labels::LabelMask mask = mask_of({50, 50, 50}, {1, 1, 1}, [](const Vec3& p) {
    return norm(p - Vec3{25, 25, 25}) < 10;
  });
  Context context;
  context.max_memory = 1 << 20;
  EXPECT_THROW((void)labels::label_density(context, mask, {}), Error);
  EXPECT_THROW((void)labels::label_density({}, mask, {.voxel = 6.5}), Error);
  context.max_memory = std::uint64_t{1} << 30U;
  EXPECT_NO_THROW((void)labels::label_density(context, mask, {.voxel = 5.5}));
  EXPECT_THROW((void)labels::label_density(context, mask, {.voxel = 1e-5}), Error);
}
