// Voxelization against CGAL's exact point-in-mesh test.

#include "base/error.h"
#include "cgal_side.h"
#include "volume/lattice.h"
#include "voxelization/ray_crossings.h"

#include <gtest/gtest.h>

#include <random>

namespace {

using namespace gewebe;
using namespace gewebe::test;

/// Compares all voxels around the mesh.
SideCount compare(const TriangleMesh& mesh, const volume::GridTransform& lattice,
                  const volume::GridTransform& tested_lattice) {
  const CgalSide side(mesh, lattice);
  EXPECT_EQ(side.faces(), mesh.triangles.size());
  Box3 box;
  for (const Vec3& point : mesh.points)
    box.add(lattice.to_index(point));
  voxelization::VoxelizeReport report;
  const voxelization::InsideScan scan =
      voxelization::scan_inside(Context{}, mesh, tested_lattice, {}, &report);
  EXPECT_EQ(report.odd_rays, 0u);
  return compare_box(
      side, scan,
      {voxelization::floor_int(box.min.x) - 1, voxelization::floor_int(box.min.y) - 1,
       voxelization::floor_int(box.min.z) - 1},
      {voxelization::floor_int(box.max.x) + 2, voxelization::floor_int(box.max.y) + 2,
       voxelization::floor_int(box.max.z) + 2});
}

SideCount compare(const TriangleMesh& mesh) {
  return compare(mesh, volume::uniform_transform(1), volume::uniform_transform(1));
}

TEST(VoxelizeCgal, RandomRotatedSolids) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(0, 6);
  for (int n = 0; n < 4; ++n) {
    TriangleMesh mesh = n % 2 == 0 ? box_mesh({-9, -5, -7}, {8, 11, 10}) : sphere_mesh(2, 15, {});
    if (n == 3) // spiky: every second point pulled in
      for (std::size_t p = 0; p < mesh.points.size(); p += 2)
        mesh.points[p] *= 0.4;
    rotate(mesh, angle(random));
    const SideCount result = compare(mesh);
    EXPECT_GT(result.inside, 1000u);
    EXPECT_EQ(result.wrong, 0u);
  }
}

TEST(VoxelizeCgal, PointsOnVoxelCentres) {
  TriangleMesh mesh = sphere_mesh(2, 12, {});
  for (Vec3& p : mesh.points)
    p = {std::round(p.x), std::round(p.y), std::round(p.z)};
  const SideCount result = compare(mesh);
  EXPECT_EQ(result.wrong, 0u);
  EXPECT_GT(result.on_surface, 100u);
}

TEST(VoxelizeCgal, HalfAVoxelIsSeen) { // negative control
  volume::GridTransform shifted = volume::uniform_transform(1);
  shifted.m[7] = 0.5;
  EXPECT_GT(compare(sphere_mesh(2, 12, {}), volume::uniform_transform(1), shifted).wrong, 100u);
}

TEST(VoxelizeCgal, Cubes) {
  for (const int size : {1, 2, 7, 16})
    for (int eighth = 0; eighth < 8; ++eighth) {
      const Vec3 low{eighth / 8.0, -3 + eighth / 4.0, -5};
      const SideCount result =
          compare(box_mesh(low, low + Vec3{1.0 * size, 1.0 * size, 1.0 * size}));
      EXPECT_EQ(result.wrong, 0u);
      EXPECT_EQ(result.inside, static_cast<std::size_t>(size * size * size));
    }
}

TEST(VoxelizeCgal, TouchingCubes) {
  TriangleMesh mesh = box_mesh({-6, -5, -4}, {1, 5, 4});
  append(mesh, box_mesh({1, -5, -4}, {9, 5, 4}));
  const SideCount result = compare(mesh);
  EXPECT_EQ(result.wrong, 0u);
  EXPECT_EQ(result.inside, 15u * 10 * 8);
  EXPECT_GT(result.on_surface, 400u);
}

TEST(VoxelizeCgal, NestedShellsAndHollowSphere) {
  TriangleMesh mesh = sphere_mesh(3, 20, {0.1, 0, 0});
  append(mesh, sphere_mesh(2, 15, {0, 0.3, 0}));
  EXPECT_EQ(compare(mesh).wrong, 0u);
  append(mesh, sphere_mesh(2, 9, {}));
  append(mesh, sphere_mesh(1, 4, {1, 1, 1}));
  const SideCount result = compare(mesh);
  EXPECT_EQ(result.wrong, 0u);
  EXPECT_GT(result.inside, 10000u);
}

TEST(VoxelizeCgal, ThinWalledBottle) {
  for (const double angle : {0.0, 0.7}) {
    TriangleMesh mesh = thin_bottle();
    rotate(mesh, angle);
    EXPECT_GT(signed_volume(mesh), 0);
    const SideCount result = compare(mesh);
    EXPECT_EQ(result.wrong, 0u);
    EXPECT_GT(result.inside, 300u);
  }
}

TEST(VoxelizeCgal, Slivers) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> tiny(-1e-13, 1e-13), place(-12, 12);
  for (int n = 0; n < 40; ++n) {
    TriangleMesh needle;
    const double thin = n % 2 == 0 ? 1e-9 : 0.4;
    const Vec3 far{place(random), place(random), place(random)};
    needle.points = {far, far * -1 + Vec3{tiny(random), 0, tiny(random)},
                     Vec3{place(random), place(random), place(random)} * thin,
                     Vec3{1, 1, 1 + tiny(random)} * thin};
    needle.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    EXPECT_EQ(compare(needle).wrong, 0u);
  }
}

/// Every voxel of every leaf that the surface meets, every tile's middle, and points at random.
void compare_file(const std::string& name, std::int64_t dim) {
  const TriangleMesh mesh = load_test_mesh(name);
  if (mesh.triangles.empty())
    GTEST_SKIP() << "no " << name;
  const volume::GridTransform lattice = volume::lattice_for_dim(bounding_box(mesh), dim);
  const CgalSide side(mesh, lattice);
  ASSERT_EQ(side.faces(), mesh.triangles.size());
  voxelization::VoxelizeReport report;
  const voxelization::InsideScan scan =
      voxelization::scan_inside(Context{}, mesh, lattice, {}, &report);
  EXPECT_EQ(report.odd_rays, 0u);
  const ScanLookup lookup(scan);
  SideCount result;
  const auto ask = [&](const Int3& v) { result.add(side.at(v), lookup.inside(v)); };
  for (const Int3& o : scan.origins)
    for (std::int32_t v = 0; v < volume::leaf_voxels; ++v)
      ask({o[0] + v / 64, o[1] + v / 8 % 8, o[2] + v % 8});
  for (const volume::TileView& t : scan.tiles)
    ask({t.origin[0] + t.dim / 2, t.origin[1] + t.dim / 2, t.origin[2] + t.dim / 2});
  Int3 min{}, max{};
  EXPECT_TRUE(volume::index_range(lattice, bounding_box(mesh), min, max));
  std::mt19937 random(1);
  for (int n = 0; n < 20000; ++n) {
    Int3 v{};
    for (std::size_t a = 0; a < 3; ++a)
      v[a] = std::uniform_int_distribution<std::int32_t>(min[a] - 2, max[a] + 2)(random);
    ask(v);
  }
  EXPECT_GT(result.inside, 1000u);
  EXPECT_EQ(result.wrong, 0u);
}

TEST(VoxelizeCgal, Liver) {
  compare_file("sofa_liver_coarse.obj", 64);
  compare_file("sofa_liver_smooth.obj", 128);
}
TEST(VoxelizeCgal, Colon) {
  compare_file("gca90_large_intestine_20k.stl", 128);
}
TEST(VoxelizeCgal, Spleen) {
  compare_file("hubmap_F_spleen_uv.obj", 128);
}

} // namespace
