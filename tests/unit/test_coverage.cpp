// Volume fractions of voxels: analytic cases, sums, ties, overlaps, comparison with samples.

#include "antialiasing/coverage.h"
#include "base/error.h"
#include "mesh/border.h"
#include "mesh_fixtures.h"
#include "repair/orient_closed.h"
#include "tests/unit/larger.h"
#include "volume/lattice.h"
#include "volume/volume_stats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace {

using namespace gewebe;
using namespace gewebe::test;

const volume::GridTransform unit_lattice = volume::uniform_transform(1);

Context with(int threads, CpuLevel cpu = best_cpu_level()) {
  Context context;
  context.threads = threads;
  context.cpu = cpu;
  return context;
}

volume::Grid exact(const TriangleMesh& mesh, const volume::GridTransform& t = unit_lattice,
                   antialiasing::CoverageReport* report = nullptr) {
  std::optional<volume::Grid> grid =
      antialiasing::exact_coverage(with(1), mesh, t, voxelization::OpenMesh::refuse, report);
  EXPECT_TRUE(grid.has_value());
  return grid.has_value() ? *std::move(grid) : volume::Grid();
}

double length_in_voxel(double low, double high, std::int32_t n) {
  return std::fmax(0, std::fmin(high, n + 0.5) - std::fmax(low, n - 0.5));
}

/// Largest difference to the box's product of lengths over all voxels about it.
double box_error(const volume::Grid& grid, const Vec3& low, const Vec3& high) {
  volume::GridAccessor value(grid);
  double worst = 0;
  const auto from = [](double x) { return static_cast<std::int32_t>(std::floor(x)) - 2; };
  for (std::int32_t i = from(low.x); i < high.x + 3; ++i)
    for (std::int32_t j = from(low.y); j < high.y + 3; ++j)
      for (std::int32_t k = from(low.z); k < high.z + 3; ++k) {
        const double wanted = length_in_voxel(low.x, high.x, i) *
                              length_in_voxel(low.y, high.y, j) * length_in_voxel(low.z, high.z, k);
        const double error = std::fabs(static_cast<double>(value.value({i, j, k})) - wanted);
        worst = test::larger(worst, error);
      }
  return worst;
}

TEST(Coverage, BoxesAtEveryEighth) {
  for (int size = 1; size <= 12; ++size)
    for (int eighth = 0; eighth < 8; ++eighth) {
      const double o = eighth / 8.0, s = size * 0.75;
      const Vec3 low{o - 3, o / 2, -o - 20}, high = low + Vec3{s, s, s};
      const volume::Grid grid = exact(box_mesh(low, high));
      ASSERT_EQ(box_error(grid, low, high), 0) << "size " << s << " offset " << o; // all are dyadic
    }
}

TEST(Coverage, BoxesAnywhere) {
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> place(-15, 15);
  for (int n = 0; n < 40; ++n) {
    Vec3 low, high;
    for (int a = 0; a < 3; ++a) {
      const double p = place(random), q = place(random);
      low[a] = std::fmin(p, q);
      high[a] = std::fmax(p, q);
    }
    antialiasing::CoverageReport report;
    const volume::Grid grid = exact(box_mesh(low, high), unit_lattice, &report);
    ASSERT_LT(box_error(grid, low, high), 6e-8);
    const Vec3 s = high - low;
    ASSERT_LT(std::fabs(report.volume / (s.x * s.y * s.z) - 1), 1e-12);
    ASSERT_GT(box_error(grid, low + Vec3{0, 0, 1e-3}, high), 6e-8); // negative control
  }
}

TEST(Coverage, WallsThinnerThanAVoxel) {
  for (const double thickness : {0.5, 1e-3, 1e-9}) {
    const Vec3 low{-10.3, -7.2, 0.3}, high{9.6, 8.1, 0.3 + thickness};
    for (int turn = 0; turn < 3; ++turn) {
      const auto turned = [&](const Vec3& p) {
        return Vec3{p[turn], p[(turn + 1) % 3], p[(turn + 2) % 3]};
      };
      antialiasing::CoverageReport report;
      const volume::Grid grid = exact(box_mesh(turned(low), turned(high)), unit_lattice, &report);
      EXPECT_LT(box_error(grid, turned(low), turned(high)), 6e-8);
      EXPECT_LT(std::fabs(report.volume / (19.9 * 15.3 * (high.z - low.z)) - 1),
                1e-12 + 1e-14 / thickness);
      volume::GridAccessor value(grid);
      EXPECT_NEAR(static_cast<double>(value.value({0, 0, 0})), std::fmin(thickness, 0.2), 1e-7);
    }
  }
}

TEST(Coverage, HalfSpacesOfTetrahedra) {
  // The corner x + y + z < s of the positive octant, voxel (0, 0, 0) being [-½, ½]³: the fraction
  // is the polynomial of the cut-off corner, sum over corners of (s - corner)+³ / 6.
  for (const double s : {0.1, 0.5, 0.9, 1.0, 1.4, 1.7, 2.0, 2.6, 3.0}) {
    TriangleMesh corner;
    const Vec3 o{-0.5, -0.5, -0.5};
    corner.points = {o, o + Vec3{s, 0, 0}, o + Vec3{0, s, 0}, o + Vec3{0, 0, s}};
    corner.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    const auto cube = [](double x) { return x > 0 ? x * x * x / 6 : 0; };
    antialiasing::CoverageReport report;
    const volume::Grid grid = exact(corner, unit_lattice, &report);
    EXPECT_NEAR(static_cast<double>(volume::GridAccessor(grid).value({0, 0, 0})),
                cube(s) - 3 * cube(s - 1) + 3 * cube(s - 2), 6e-8);
    EXPECT_LT(std::fabs(report.volume - s * s * s / 6), 1e-15 * 10);
  }
}

TEST(Coverage, SumIsTheSignedVolume) {
  for (int levels = 0; levels <= 4; ++levels)
    for (const double radius : {0.3, 3.0, 30.0}) {
      const TriangleMesh mesh = sphere_mesh(levels, radius, {0.1, -0.2, 0.3});
      antialiasing::CoverageReport report;
      const volume::Grid grid = exact(mesh, unit_lattice, &report);
      const double volume = signed_volume(mesh);
      EXPECT_LT(std::fabs(report.winding_volume / volume - 1), 1e-12);
      EXPECT_LT(std::fabs(report.volume / volume - 1), 1e-12);
      const double written = volume::volume_stats(with(1), grid).volume;
      // Rounding to float is fair: what is left falls with the root of the number of voxels.
      EXPECT_LT(std::fabs(written / volume - 1), radius > 20 ? 1e-9 : 1e-7);
      EXPECT_EQ(report.overlap_voxels, 0u);
    }
}

TEST(Coverage, FarAwayAndScaled) {
  const TriangleMesh mesh = sphere_mesh(3, 8, {0.25, 0.5, -0.125});
  const double volume = signed_volume(mesh);
  for (const double offset : {0.0, 1e3, 1e6}) {
    TriangleMesh moved = mesh;
    for (Vec3& p : moved.points)
      p += Vec3{offset, -offset, offset};
    antialiasing::CoverageReport report;
    exact(moved, unit_lattice, &report);
    EXPECT_LT(std::fabs(report.volume / volume - 1), 1e-12 + 1e-15 * offset);
  }
  for (const double scale : {1e-9, 1e9}) {
    TriangleMesh scaled = mesh;
    for (Vec3& p : scaled.points)
      p *= scale;
    antialiasing::CoverageReport report;
    exact(scaled, volume::uniform_transform(scale), &report);
    EXPECT_LT(std::fabs(report.volume / (volume * scale * scale * scale) - 1), 1e-12);
  }
}

/// Values against samples³ samples: they differ by at most the samples of the cells of the fine
/// lattice that the surface meets.
TEST(Coverage, AgreesWithSamples) {
  constexpr int samples = 24;
  TriangleMesh mesh = sphere_mesh(2, 5, {0.3, -0.2, 0.1});
  append(mesh, sphere_mesh(1, 2, {1, 0, 0})); // a hollow
  TriangleMesh bar = box_mesh({-9, -0.3, -0.2}, {9, 0.4, 0.3});
  rotate(bar, 0.7);
  for (const TriangleMesh& m : {mesh, bar}) {
    const volume::Grid fractions = exact(m);
    const volume::Grid counts =
        voxelization::voxelize(with(1), m, unit_lattice, {.samples = samples});
    volume::GridAccessor a(fractions), b(counts);
    double worst = 0, sum = 0, total = 0;
    for (std::int32_t i = -10; i <= 10; ++i)
      for (std::int32_t j = -10; j <= 10; ++j)
        for (std::int32_t k = -10; k <= 10; ++k) {
          const double x = static_cast<double>(a.value({i, j, k}));
          const double y = static_cast<double>(b.value({i, j, k}));
          worst = test::larger(worst, std::fabs(x - y));
          if (x > 0 && x < 1) {
            sum += x - y;
            ++total;
          }
        }
    EXPECT_GT(total, 50);
    EXPECT_LT(worst, 0.03); // an area of at most about 2, each of its cells wrong by half at most
    EXPECT_LT(std::fabs(sum / total), 1e-3);
  }
}

TEST(Coverage, PointsOnTheLattice) {
  // Vertices on centres, corners and edges of voxels, faces in their planes.
  std::mt19937 random(5);
  std::uniform_int_distribution<int> halves(-15, 15);
  for (int n = 0; n < 200; ++n) {
    TriangleMesh mesh = n % 2 == 0 ? sphere_mesh(1, 6, {0, 0, 0}) : box_mesh({0, 0, 0}, {1, 1, 1});
    for (Vec3& p : mesh.points)
      p = n % 2 == 0
              ? Vec3{std::round(2 * p.x) / 2, std::round(2 * p.y) / 2, std::round(2 * p.z) / 2}
              : Vec3{halves(random) / 2.0, halves(random) / 2.0, halves(random) / 2.0};
    antialiasing::CoverageReport report;
    const volume::Grid grid = exact(mesh, unit_lattice, &report);
    const double volume = std::fabs(signed_volume(mesh));
    EXPECT_LT(std::fabs(std::fabs(report.winding_volume) - volume), 1e-12 * (100 + volume));
    const volume::VolumeStats stats = volume::volume_stats(with(1), grid);
    EXPECT_GE(stats.min, 0);
    EXPECT_LE(stats.max, 1);
  }
}

TEST(Coverage, NestedShellsAreHollowWhateverTheirOrientation) {
  // 0.3 voxels between the shells: one voxel meets three winding numbers unless parts are turned.
  for (const bool inward : {false, true}) {
    TriangleMesh mesh = sphere_mesh(3, 9.3, {0.1, 0, 0.2});
    TriangleMesh inner = sphere_mesh(3, 9.0, {0.1, 0, 0.2});
    const double volume = signed_volume(mesh) - signed_volume(inner);
    if (inward)
      for (Triangle& t : inner.triangles)
        std::swap(t[1], t[2]);
    append(mesh, inner);
    append(mesh, sphere_mesh(2, 4, {0.1, 0, 0.2}));
    antialiasing::CoverageReport report;
    const volume::Grid grid = exact(mesh, unit_lattice, &report);
    const double core = signed_volume(sphere_mesh(2, 4, {0.1, 0, 0.2}));
    EXPECT_LT(std::fabs(report.volume / (volume + core) - 1), 1e-12);
    EXPECT_EQ(volume::GridAccessor(grid).value({0, 0, 0}), 1.0f);
    EXPECT_EQ(volume::GridAccessor(grid).value({6, 0, 0}), 0.0f);
  }
}

TEST(Coverage, OverlapsAreLeftOutAsByParity) {
  TriangleMesh mesh = box_mesh({0.1, 0.2, 0.3}, {8.1, 8.2, 8.3});
  append(mesh, box_mesh({4.1, -2.3, -2.4}, {12.1, 6.2, 6.3}));
  antialiasing::CoverageReport report;
  const volume::Grid grid = exact(mesh, unit_lattice, &report);
  volume::GridAccessor value(grid);
  EXPECT_EQ(value.value({6, 3, 3}), 0.0f); // in both
  EXPECT_EQ(value.value({2, 3, 3}), 1.0f);
  EXPECT_EQ(value.value({10, 0, 0}), 1.0f);
  // A face of the one within the other, the other's faces far: winding numbers 1 and 2 only.
  EXPECT_NEAR(static_cast<double>(value.value({4, 3, 3})), 0.6, 1e-7);
  EXPECT_GT(report.overlap_voxels, 0u);
  EXPECT_LT(std::fabs(report.winding_volume - 512 - 8 * 8.5 * 8.7), 1e-9);
}

TEST(Coverage, OrientationAndOrderDoNotMatter) {
  TriangleMesh mesh = sphere_mesh(3, 9.7, {0.3, 0.1, 0.2});
  append(mesh, sphere_mesh(2, 5.1, {0.3, 0.1, 0.2}));
  antialiasing::CoverageReport expected, report;
  const volume::Grid a = exact(mesh, unit_lattice, &expected);
  std::mt19937 random(7);
  for (Triangle& t : mesh.triangles)
    std::shuffle(t.begin(), t.end(), random);
  const volume::Grid b = exact(mesh, unit_lattice, &report);
  EXPECT_LT(std::fabs(report.volume / expected.volume - 1), 1e-13);
  volume::GridAccessor x(a), y(b);
  for (std::int32_t i = -11; i < 11; ++i)
    for (std::int32_t j = -11; j < 11; ++j)
      for (std::int32_t k = -11; k < 11; ++k)
        ASSERT_NEAR(x.value({i, j, k}), y.value({i, j, k}), 1.2e-7f);
}

TEST(Coverage, TouchingSolidsAddUp) {
  const TriangleMesh whole = box_mesh({-2.3, -2.3, -2.3}, {7.4, 7.4, 7.4});
  TriangleMesh parts = box_mesh({-2.3, -2.3, -2.3}, {7.4, 7.4, 3.2});
  append(parts, box_mesh({-2.3, -2.3, 3.2}, {7.4, 7.4, 7.4})); // the shared face twice
  const volume::Grid a = exact(whole), b = exact(parts);
  volume::GridAccessor x(a), y(b);
  for (std::int32_t i = -4; i < 10; ++i)
    for (std::int32_t j = -4; j < 10; ++j)
      for (std::int32_t k = -4; k < 10; ++k)
        ASSERT_NEAR(x.value({i, j, k}), y.value({i, j, k}), 1.2e-7f) << i << ' ' << j << ' ' << k;
}

TEST(Coverage, SolidsSetIntoEachOtherAddUp) {
  // A body with a dent that another body fills: most of the second's surface is the first's too.
  TriangleMesh mesh;
  const Vec3 a{-5.3, -5.2, -5.1}, b{5.3, 5.2, 5.1}, c{-2.7, -2.6, -0.4}, d{2.7, 2.6, 5.1};
  mesh = box_mesh(a, b);
  TriangleMesh plug = box_mesh(c, d);
  // Body: the box less the plug, as the box's surface without the top, the dent, and a ring on top.
  mesh.triangles.erase(mesh.triangles.begin() + 2, mesh.triangles.begin() + 4);
  const auto base = static_cast<std::uint32_t>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), plug.points.begin(), plug.points.end());
  for (std::size_t n = 0; n < plug.triangles.size(); ++n)
    if (n != 2 && n != 3) // all but its top, inward
      mesh.triangles.push_back(
          {plug.triangles[n][0] + base, plug.triangles[n][2] + base, plug.triangles[n][1] + base});
  const std::array<std::uint32_t, 4> ring{4, 5, 7, 6};
  for (std::size_t n = 0; n < 4; ++n) {
    const std::uint32_t p = ring[n], q = ring[(n + 1) % 4];
    mesh.triangles.push_back({p, q, q + base});
    mesh.triangles.push_back({p, q + base, p + base});
  }
  append(mesh, plug);
  antialiasing::CoverageReport report;
  const volume::Grid grid = exact(mesh, unit_lattice, &report);
  EXPECT_LT(box_error(grid, a, b), 1.2e-7);
}

TEST(Coverage, SameBytesForAnyThreadsAndProcessor) {
  const TriangleMesh mesh = sphere_mesh(4, 60, {0.3, 0.1, 0.2});
  const auto digests = [&](const Context& context) {
    return std::array{
        antialiasing::exact_coverage(context, mesh, unit_lattice, voxelization::OpenMesh::refuse)
            ->digest(),
        antialiasing::line_coverage(context, mesh, unit_lattice, 3, voxelization::OpenMesh::refuse)
            .digest()};
  };
  const auto expected = digests(with(1));
  EXPECT_EQ(digests(with(2)), expected);
  EXPECT_EQ(digests(with(0, CpuLevel::baseline)), expected);
  EXPECT_NE(expected[0], expected[1]);
}

TEST(Coverage, LinesAreExactAlongThemselves) {
  // A box whose walls along the rays lie between voxels: any number of rays gives the fractions.
  const Vec3 low{-3.5, -2.5, 0.3}, high{4.5, 5.5, 7.9};
  for (const int rays : {1, 2, 5}) {
    antialiasing::CoverageReport report;
    const volume::Grid grid = antialiasing::line_coverage(
        with(1), box_mesh(low, high), unit_lattice, rays, voxelization::OpenMesh::refuse, &report);
    EXPECT_LT(box_error(grid, low, high), 6e-8);
    EXPECT_EQ(report.mesh.odd_rays, 0u);
  }
  // Else the error falls as rays become more.
  const TriangleMesh mesh = sphere_mesh(3, 8, {0.1, 0.2, 0.3});
  const volume::Grid fractions = exact(mesh);
  double last = 1;
  for (const int rays : {1, 4, 16}) {
    const volume::Grid grid = antialiasing::line_coverage(with(1), mesh, unit_lattice, rays,
                                                          voxelization::OpenMesh::refuse);
    volume::GridAccessor a(fractions), b(grid);
    double sum = 0;
    for (std::int32_t i = -9; i < 10; ++i)
      for (std::int32_t j = -9; j < 10; ++j)
        for (std::int32_t k = -9; k < 10; ++k)
          sum += std::fabs(static_cast<double>(a.value({i, j, k}) - b.value({i, j, k})));
    EXPECT_LT(sum, last * (rays == 1 ? 1000 : 0.4));
    last = sum;
  }
}

TEST(Coverage, OpenMeshes) {
  TriangleMesh open = box_mesh({0.2, 0.2, 0.2}, {10.2, 10.2, 10.2});
  open.triangles.erase(open.triangles.begin(), open.triangles.begin() + 2);
  EXPECT_THROW(
      antialiasing::exact_coverage(with(1), open, unit_lattice, voxelization::OpenMesh::refuse),
      Error);
  EXPECT_THROW(
      antialiasing::line_coverage(with(1), open, unit_lattice, 2, voxelization::OpenMesh::refuse),
      Error);
  antialiasing::CoverageReport report;
  EXPECT_FALSE(antialiasing::exact_coverage(with(1), open, unit_lattice,
                                            voxelization::OpenMesh::skip, &report)
                   .has_value());
  EXPECT_EQ(report.mesh.boundary_edges, 4u);
  antialiasing::line_coverage(with(1), open, unit_lattice, 2, voxelization::OpenMesh::skip,
                              &report);
  EXPECT_EQ(report.mesh.odd_rays, 400u);
  EXPECT_EQ(report.volume, 0);
  const auto filled = antialiasing::exact_coverage(with(1), open, unit_lattice,
                                                   voxelization::OpenMesh::fill, &report);
  ASSERT_TRUE(filled.has_value());
  EXPECT_EQ(report.mesh.holes, 1u);
  EXPECT_LT(box_error(*filled, {0.2, 0.2, 0.2}, {10.2, 10.2, 10.2}), 6e-8);
}

TEST(Coverage, BadInputAndMemory) {
  const TriangleMesh mesh = sphere_mesh(3, 50, {0, 0, 0});
  Context context = with(1);
  context.max_memory = std::uint64_t{1} << 30;
  EXPECT_THROW(antialiasing::exact_coverage(context, mesh, volume::uniform_transform(1e-6),
                                            voxelization::OpenMesh::refuse),
               Error);
  EXPECT_THROW(antialiasing::line_coverage(context, mesh, volume::uniform_transform(1e-6), 2,
                                           voxelization::OpenMesh::refuse),
               Error);
  EXPECT_THROW(
      antialiasing::exact_coverage(with(1), {}, unit_lattice, voxelization::OpenMesh::refuse),
      Error);
  EXPECT_THROW(antialiasing::exact_coverage(with(1), mesh, volume::uniform_transform(1e-9),
                                            voxelization::OpenMesh::refuse),
               Error);
  EXPECT_THROW(
      antialiasing::line_coverage(with(1), mesh, unit_lattice, 0, voxelization::OpenMesh::refuse),
      Error);
  EXPECT_THROW(
      antialiasing::line_coverage(with(1), mesh, unit_lattice, 65, voxelization::OpenMesh::refuse),
      Error);
  volume::GridTransform flat = unit_lattice;
  flat.m[0] = 2;
  EXPECT_THROW(antialiasing::exact_coverage(with(1), mesh, flat, voxelization::OpenMesh::refuse),
               Error);
  for (const double radius : {3.0, 30.0, 100.0}) {
    const TriangleMesh ball = sphere_mesh(3, radius, {0, 0, 0});
    EXPECT_LT(static_cast<double>(exact(ball).memory_bytes()),
              antialiasing::coverage_bytes(ball, unit_lattice));
  }
}

TEST(Orient, OneSidedSurfacesHaveNone) {
  // Six points, ten triangles: the projective plane, every edge in two triangles.
  const std::vector<Vec3> points{{0, 0, 1},      {1, 0, 0},       {0.3, 1, 0},
                                 {-0.8, 0.6, 0}, {-0.8, -0.6, 0}, {0.3, -1, 0}};
  std::vector<Triangle> triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 1},
                                  {1, 2, 4}, {2, 3, 5}, {3, 4, 1}, {4, 5, 2}, {5, 1, 3}};
  EXPECT_TRUE(mesh::odd_edges(points, triangles).empty());
  const auto before = triangles;
  EXPECT_FALSE(repair::orient_closed(points, triangles));
  EXPECT_EQ(triangles, before);
}

TEST(Orient, MendsAndTurns) {
  TriangleMesh mesh = sphere_mesh(2, 5, {});
  repair::OrientReport report;
  EXPECT_TRUE(repair::orient_closed(mesh.points, mesh.triangles, &report));
  EXPECT_EQ(report.flipped, 0u);
  EXPECT_EQ(report.parts, 1u);
  for (Triangle& t : mesh.triangles)
    std::swap(t[0], t[1]);
  std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
  append(mesh, sphere_mesh(1, 2, {}));
  EXPECT_TRUE(repair::orient_closed(mesh.points, mesh.triangles, &report));
  EXPECT_EQ(report.parts, 2u);
  EXPECT_EQ(report.flipped, mesh.triangles.size() - 1); // all but the one, the inner ones inward
  EXPECT_NEAR(signed_volume(mesh),
              signed_volume(sphere_mesh(2, 5, {})) - signed_volume(sphere_mesh(1, 2, {})), 1e-9);
  mesh.triangles.pop_back();
  EXPECT_FALSE(repair::orient_closed(mesh.points, mesh.triangles, &report));
}

TEST(Coverage, Organs) {
  for (const char* name : {"sofa_liver_smooth.obj", "gca90_large_intestine_20k.stl"}) {
    const TriangleMesh mesh = load_test_mesh(name);
    if (mesh.triangles.empty())
      GTEST_SKIP() << "no " << name;
    const volume::GridTransform lattice = volume::lattice_for_dim(bounding_box(mesh), 128);
    antialiasing::CoverageReport report;
    const volume::Grid grid = exact(mesh, lattice, &report);
    EXPECT_LT(std::fabs(report.winding_volume / signed_volume(mesh) - 1), 1e-12) << name;
    EXPECT_LT(std::fabs(volume::volume_stats(with(1), grid).volume / report.volume - 1), 1e-9)
        << name;
  }
}

} // namespace
