// Voxelization: analytic cases, ties, partitions, open meshes, supersampling.

#include "base/error.h"
#include "mesh/border.h"
#include "mesh_fixtures.h"
#include "volume/lattice.h"
#include "voxelization/voxelize.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <random>

namespace {

using namespace gewebe;
using namespace gewebe::test;

const volume::GridTransform unit_lattice = volume::uniform_transform(1);

std::set<Int3> voxels(const TriangleMesh& mesh, const volume::GridTransform& t = unit_lattice,
                      voxelization::VoxelizeReport* report = nullptr) {
  return inside_voxels(voxelization::scan_inside(Context{}, mesh, t, {}, report));
}

std::uint64_t count(const voxelization::InsideScan& scan) {
  std::uint64_t sum = 0;
  for (const auto& leaf : scan.bits)
    for (const std::uint64_t word : leaf)
      sum += static_cast<std::uint64_t>(std::popcount(word));
  for (const auto& leaf : scan.counts)
    for (const std::uint32_t c : leaf)
      sum += c;
  const auto full = static_cast<std::uint64_t>(scan.samples * scan.samples * scan.samples);
  for (const volume::TileView& t : scan.tiles)
    sum += full * static_cast<std::uint64_t>(t.dim) * static_cast<std::uint64_t>(t.dim) *
           static_cast<std::uint64_t>(t.dim);
  return sum;
}

/// Integers n with low <= n < high when each n is moved up by an infinitesimal: low <= n < high.
std::int64_t integers_between(double low, double high) {
  return static_cast<std::int64_t>(std::ceil(high)) - static_cast<std::int64_t>(std::ceil(low));
}

TEST(Voxelize, CubesOfEverySizeAtEveryEighth) {
  for (int size = 1; size <= 64; ++size)
    for (int eighth = 0; eighth < 8; ++eighth) {
      const double o = eighth / 8.0, s = size;
      // Different offsets along the three axes, so that faces on centres meet faces between them.
      const Vec3 low{o - 3, o / 2, -o - 20};
      const voxelization::InsideScan scan = voxelization::scan_inside(
          Context{}, box_mesh(low, low + Vec3{s, s, s}), unit_lattice, {});
      ASSERT_EQ(count(scan), static_cast<std::uint64_t>(size) * static_cast<std::uint64_t>(size) *
                                 static_cast<std::uint64_t>(size))
          << "size " << size << " offset " << o;
    }
}

TEST(Voxelize, BoxesOfAnySize) {
  std::mt19937 random(4);
  std::uniform_int_distribution<int> eighths(-120, 120);
  for (int n = 0; n < 300; ++n) {
    Vec3 low, high;
    std::int64_t expected = 1;
    for (int a = 0; a < 3; ++a) {
      const int p = eighths(random), q = eighths(random);
      low[a] = std::min(p, q) / 8.0;
      high[a] = std::max(p, q) / 8.0;
      expected *= integers_between(low[a], high[a]);
    }
    ASSERT_EQ(count(voxelization::scan_inside(Context{}, box_mesh(low, high), unit_lattice, {})),
              static_cast<std::uint64_t>(expected));
  }
}

TEST(Voxelize, TouchingBoxesPartitionSpace) {
  // The shared face x = 3 lies on voxel centres, so do all other faces.
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 cut_high{7, 7, 7}, cut_low{-2, -2, -2};
    cut_high[axis] = cut_low[axis] = 3;
    const auto a = voxels(box_mesh({-2, -2, -2}, cut_high));
    const auto b = voxels(box_mesh(cut_low, {7, 7, 7}));
    std::set<Int3> both = a;
    both.insert(b.begin(), b.end());
    EXPECT_EQ(both.size(), a.size() + b.size());
    EXPECT_EQ(both, voxels(box_mesh({-2, -2, -2}, {7, 7, 7})));
  }
}

/// Tetrahedra that share faces, edges and vertices on voxel centres: each centre of the cube
/// belongs to one.
TEST(Voxelize, TetrahedraOfACubePartitionIt) {
  for (int size = 1; size <= 12; ++size) {
    const double s = size;
    const TriangleMesh cube = box_mesh({0, 0, 0}, {s, s, s});
    std::set<Int3> all;
    std::size_t sum = 0;
    std::array<int, 3> axes{0, 1, 2};
    do { // Kuhn's six tetrahedra: paths from corner 0 to corner 7
      const auto p1 = static_cast<std::uint32_t>(1 << axes[0]);
      const auto p2 = p1 | static_cast<std::uint32_t>(1 << axes[1]);
      TriangleMesh tetrahedron;
      tetrahedron.points = cube.points;
      tetrahedron.triangles = {{0, p1, p2}, {0, p1, 7}, {0, p2, 7}, {p1, p2, 7}};
      const auto inside = voxels(tetrahedron);
      sum += inside.size();
      all.insert(inside.begin(), inside.end());
    } while (std::next_permutation(axes.begin(), axes.end()));
    EXPECT_EQ(sum, all.size());
    EXPECT_EQ(all.size(), static_cast<std::size_t>(size * size * size));
    EXPECT_EQ(all, voxels(cube));
  }
}

TEST(Voxelize, EveryRayIsEvenWhenEveryPointIsOnACentre) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> place(-9, 9);
  for (int n = 0; n < 200; ++n) {
    TriangleMesh mesh = sphere_mesh(1, 8, {0, 0, 0});
    for (Vec3& p : mesh.points)
      p = n % 2 == 0 ? Vec3{std::round(p.x), std::round(p.y), std::round(p.z)}
                     : Vec3{static_cast<double>(place(random)), static_cast<double>(place(random)),
                            static_cast<double>(place(random))};
    voxelization::VoxelizeReport report;
    EXPECT_NO_THROW(voxelization::scan_inside(Context{}, mesh, unit_lattice, {}, &report));
    EXPECT_EQ(report.odd_rays, 0u);
    EXPECT_EQ(report.boundary_edges, 0u);
    EXPECT_GT(report.exact_tests, 0u);
  }
}

TEST(Voxelize, SliversAreExact) {
  // A sheet cut into needles across the lattice: front and back differ by one voxel row at most and
  // every needle alone is closed.
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> tiny(-1e-13, 1e-13);
  for (int n = 0; n < 100; ++n) {
    TriangleMesh needle;
    needle.points = {{-30 + tiny(random), -30, -30},
                     {30, 30 + tiny(random), 30},
                     {tiny(random), tiny(random), tiny(random)},
                     {1, 1, 1 + tiny(random)}};
    needle.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}};
    voxelization::VoxelizeReport report;
    const auto inside = voxels(needle, unit_lattice, &report);
    EXPECT_EQ(report.odd_rays, 0u);
    EXPECT_LE(inside.size(), 61u);
    for (const Int3& v : inside)
      EXPECT_TRUE(v[0] == v[1] && v[1] == v[2]);
  }
}

TEST(Voxelize, SphereVolumeConverges) {
  const TriangleMesh mesh = sphere_mesh(4, 10, {0.1, 0.2, 0.3});
  const double volume = signed_volume(mesh);
  double last = 1;
  for (const double voxel : {1.0, 0.25}) {
    const double measured = static_cast<double>(count(voxelization::scan_inside(
                                Context{}, mesh, volume::uniform_transform(voxel), {}))) *
                            voxel * voxel * voxel;
    const double error = std::fabs(measured / volume - 1);
    EXPECT_LT(error, 0.02 * voxel);
    EXPECT_LT(error, last);
    last = error;
  }
  const double boxed =
      static_cast<double>(
          count(voxelization::scan_inside(Context{}, mesh, unit_lattice, {.samples = 8}))) /
      512;
  EXPECT_LT(std::fabs(boxed / volume - 1), 0.001);
}

TEST(Voxelize, NestedShellsAlternate) {
  TriangleMesh mesh = sphere_mesh(2, 12, {0, 0, 0});
  append(mesh, sphere_mesh(2, 8, {0, 0, 0}));
  append(mesh, sphere_mesh(2, 4, {0, 0, 0}));
  const auto all = voxels(mesh);
  EXPECT_TRUE(all.contains({0, 0, 0}));
  EXPECT_FALSE(all.contains({6, 0, 0}));
  EXPECT_TRUE(all.contains({0, -10, 0}));
  EXPECT_EQ(all.size(), voxels(sphere_mesh(2, 12, {})).size() -
                            voxels(sphere_mesh(2, 8, {})).size() +
                            voxels(sphere_mesh(2, 4, {})).size());
}

TEST(Voxelize, OrientationAndOrderDoNotMatter) {
  TriangleMesh mesh = sphere_mesh(3, 9.7, {0.3, 0.1, 0.2});
  const auto expected = voxels(mesh);
  std::mt19937 random(7);
  std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
  for (Triangle& t : mesh.triangles)
    std::shuffle(t.begin(), t.end(), random);
  EXPECT_EQ(voxels(mesh), expected);
}

TEST(Voxelize, SameScanForAnyNumberOfThreads) {
  const TriangleMesh mesh = sphere_mesh(4, 90, {0.3, 0.1, 0.2});
  for (const int samples : {1, 2}) {
    Context one, two;
    one.threads = 1;
    two.threads = 2;
    const voxelization::InsideScan a =
        voxelization::scan_inside(one, mesh, unit_lattice, {.samples = samples});
    const voxelization::InsideScan b =
        voxelization::scan_inside(two, mesh, unit_lattice, {.samples = samples});
    EXPECT_EQ(a.origins, b.origins);
    EXPECT_EQ(a.bits, b.bits);
    EXPECT_EQ(a.counts, b.counts);
    ASSERT_EQ(a.tiles.size(), b.tiles.size());
    EXPECT_EQ(voxelization::grid_from_scan(one, a, unit_lattice).digest(),
              voxelization::grid_from_scan(two, b, unit_lattice).digest());
  }
}

TEST(Voxelize, LargeInteriorsBecomeLargeTiles) {
  const voxelization::InsideScan scan = voxelization::scan_inside(
      Context{}, box_mesh({-200, -200, -200}, {200, 200, 200}), unit_lattice, {});
  EXPECT_EQ(std::count_if(scan.tiles.begin(), scan.tiles.end(),
                          [](const volume::TileView& t) { return t.dim == 128; }),
            8);
  EXPECT_EQ(count(scan), 400u * 400 * 400);
  EXPECT_TRUE(scan.origins.empty()); // ±200 is a multiple of 8: nothing but tiles
  const volume::Grid grid = voxelization::grid_from_scan(Context{}, scan, unit_lattice);
  EXPECT_EQ(grid.active_voxels(), 400u * 400 * 400);
  volume::GridAccessor value(grid);
  EXPECT_EQ(value.value({-200, 0, 199}), 1.0f);
  EXPECT_EQ(value.value({-201, 0, 0}), 0.0f);
  EXPECT_EQ(value.value({0, 200, 0}), 0.0f);
}

TEST(Voxelize, BoxFilterIsTheMeanOfTheFineScan) {
  TriangleMesh mesh = sphere_mesh(2, 7, {0.3, -0.2, 0.1});
  append(mesh, sphere_mesh(1, 3, {1, 0, 0}));
  rotate(mesh, 1);
  for (const int n : {2, 3, 8}) {
    // The fine lattice by itself: sample f is at (f + ½)/n - ½.
    volume::GridTransform fine = volume::uniform_transform(1.0 / n);
    for (const std::size_t at : {3u, 7u, 11u})
      fine.m[at] = 0.5 / n - 0.5;
    std::map<Int3, std::uint32_t> expected;
    for (const Int3& f : voxels(mesh, fine)) {
      const auto down = [&](std::int32_t x) { return (x - ((x % n) + n) % n) / n; };
      ++expected[{down(f[0]), down(f[1]), down(f[2])}];
    }
    const volume::Grid grid = voxelization::voxelize(Context{}, mesh, unit_lattice, {.samples = n});
    volume::GridAccessor value(grid);
    const float full = static_cast<float>(n * n * n);
    for (std::int32_t i = -9; i < 9; ++i)
      for (std::int32_t j = -9; j < 9; ++j)
        for (std::int32_t k = -9; k < 9; ++k) {
          const auto it = expected.find({i, j, k});
          const float mean = it == expected.end() ? 0.0f : static_cast<float>(it->second) / full;
          ASSERT_NEAR(value.value({i, j, k}), mean, 1e-6f);
        }
    EXPECT_EQ(grid.active_voxels(), expected.size());
  }
}

TEST(Voxelize, HalfAVoxelMatters) { // negative control of all comparisons above
  const TriangleMesh mesh = sphere_mesh(3, 9, {0.1, 0.2, 0.3});
  volume::GridTransform shifted = unit_lattice;
  shifted.m[3] = 0.5;
  EXPECT_NE(voxels(mesh), voxels(mesh, shifted));
}

TEST(Voxelize, RotatedLatticesSeeTheSameSolid) {
  const TriangleMesh mesh = sphere_mesh(3, 9, {0.1, 0.2, 0.3});
  volume::GridTransform rotated; // quarter turn about z: index (i, j, k) is world (-j, i, k)
  rotated.m = {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0};
  std::set<Int3> expected;
  for (const Int3& v : voxels(mesh))
    expected.insert({v[1], -v[0], v[2]});
  EXPECT_EQ(voxels(mesh, rotated), expected);
  volume::GridTransform flat = unit_lattice;
  flat.m[0] = 2;
  EXPECT_THROW(voxels(mesh, flat), Error);
}

TEST(Voxelize, OpenMeshesAreCountedSkippedOrFilled) {
  TriangleMesh open = box_mesh({0.2, 0.2, 0.2}, {10.2, 10.2, 10.2});
  open.triangles.erase(open.triangles.begin(), open.triangles.begin() + 2); // the face z = 0.2
  voxelization::VoxelizeReport report;
  try {
    voxelization::scan_inside(Context{}, open, unit_lattice, {}, &report);
    FAIL() << "an open mesh passed";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("4 boundary edges"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("100 odd rays"), std::string::npos);
  }
  EXPECT_EQ(report.holes, 1u);
  const voxelization::InsideScan skipped = voxelization::scan_inside(
      Context{}, open, unit_lattice, {.on_open = voxelization::OpenMesh::skip}, &report);
  EXPECT_EQ(report.odd_rays, 100u);
  EXPECT_EQ(count(skipped), 0u);
  const voxelization::InsideScan filled = voxelization::scan_inside(
      Context{}, open, unit_lattice, {.on_open = voxelization::OpenMesh::fill}, &report);
  EXPECT_EQ(report.odd_rays, 0u);
  EXPECT_EQ(count(filled), 1000u);
  for (const int samples : {2, 3}) {
    const voxelization::InsideScan boxed = voxelization::scan_inside(
        Context{}, open, unit_lattice,
        {.samples = samples, .on_open = voxelization::OpenMesh::skip}, &report);
    EXPECT_GE(report.odd_rays, 100u * static_cast<std::uint64_t>(samples * samples));
    EXPECT_EQ(count(boxed), 0u);
  }
}

TEST(Voxelize, OneMissingTriangleIsFound) {
  TriangleMesh mesh = sphere_mesh(2, 9, {0.1, 0.2, 0.3});
  mesh.triangles.pop_back();
  voxelization::VoxelizeReport report;
  EXPECT_THROW(voxelization::scan_inside(Context{}, mesh, unit_lattice, {}, &report), Error);
  EXPECT_EQ(report.boundary_edges, 3u);
}

TEST(Voxelize, UnweldedTrianglesAreClosedByPosition) {
  const TriangleMesh mesh = sphere_mesh(2, 9, {0.1, 0.2, 0.3});
  TriangleMesh soup;
  for (const Triangle& t : mesh.triangles) {
    const auto n = static_cast<std::uint32_t>(soup.points.size());
    for (const std::uint32_t corner : t)
      soup.points.push_back(mesh.points[corner]);
    soup.triangles.push_back({n, n + 1, n + 2});
  }
  EXPECT_EQ(voxels(soup), voxels(mesh));
}

TEST(Voxelize, ConesCloseAnyMesh) {
  std::mt19937 random(8);
  for (int n = 0; n < 50; ++n) {
    TriangleMesh mesh = sphere_mesh(2, 9, {0.1, 0.2, 0.3});
    std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
    mesh.triangles.resize(mesh.triangles.size() / 2);
    const auto edges = mesh::odd_edges(mesh.points, mesh.triangles);
    EXPECT_FALSE(edges.empty());
    mesh::close_with_cones(edges, mesh.points, mesh.triangles);
    EXPECT_TRUE(mesh::odd_edges(mesh.points, mesh.triangles).empty());
  }
}

TEST(Voxelize, AbsurdSizesAreRefusedWithTheNumber) {
  const TriangleMesh mesh = sphere_mesh(3, 50, {0, 0, 0});
  Context context;
  context.max_memory = std::uint64_t{8} << 30;
  for (const double voxel : {1e-6, 1e-9, 1e-60}) {
    try {
      voxelization::scan_inside(context, mesh, volume::uniform_transform(voxel), {});
      FAIL() << "accepted voxels of " << voxel;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("needs"), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(voxelization::scan_inside(Context{}, mesh, volume::uniform_transform(1e-9), {}),
               Error); // 2^30
  EXPECT_THROW(voxelization::scan_inside(Context{}, {}, unit_lattice, {}), Error);
  for (const double voxel : {1e-300, 1e300})
    EXPECT_THROW(voxelization::scan_inside(Context{}, mesh, volume::uniform_transform(voxel), {}),
                 Error);
}

TEST(Voxelize, TheEstimateHolds) {
  Context context;
  for (const double radius : {3.0, 30.0, 150.0}) {
    const TriangleMesh mesh = sphere_mesh(3, radius, {0, 0, 0});
    const volume::Grid grid = voxelization::voxelize(context, mesh, unit_lattice, {});
    const double estimate = voxelization::voxelize_bytes(mesh, unit_lattice, 1);
    EXPECT_LT(static_cast<double>(grid.memory_bytes()), estimate);
    EXPECT_GT(static_cast<double>(grid.memory_bytes()), 0.02 * estimate);
  }
}

} // namespace
