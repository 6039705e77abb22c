// Grey values by distance: planes, edges, corners, the band against a search over all triangles.

#include "antialiasing/coverage.h"
#include "antialiasing/distance_band_internal.h"
#include "antialiasing/distance_ramp.h"
#include "base/error.h"
#include "larger.h"
#include "mesh_fixtures.h"
#include "surface/gradient_normals.h"
#include "surface/marching_cubes.h"
#include "volume/volume_stats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace {

using namespace gewebe;
using namespace gewebe::test;

const volume::GridTransform unit_lattice = volume::uniform_transform(1);

Context with(int threads) {
  Context context;
  context.threads = threads;
  return context;
}

double at(volume::GridAccessor& grid, const Int3& ijk) {
  return static_cast<double>(grid.value(ijk));
}

TEST(NearestPoint, IsTheMinimumOverTheTriangle) {
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto point = [&] { return Vec3{unit(random), unit(random), unit(random)}; };
  std::array<int, 7> seen{};
  for (int n = 0; n < 2000; ++n) {
    const Vec3 a = point(), b = point(), c = point(), p = point() * 2;
    const mesh::NearestPoint nearest = mesh::nearest_on_triangle(p, a, b, c);
    ++seen[static_cast<std::size_t>(nearest.feature)];
    const double distance = norm(p - nearest.point);
    constexpr int steps = 40;
    double min = 1e9;
    for (int u = 0; u <= steps; ++u)
      for (int v = 0; u + v <= steps; ++v)
        min = test::smaller(
            min, norm(p - a - (b - a) * (u / 1.0 / steps) - (c - a) * (v / 1.0 / steps)));
    EXPECT_LE(distance, min + 1e-12);
    EXPECT_GE(distance, min - 0.1);
    // It lies in the triangle: inside all three edges' half-planes.
    const Vec3 normal = cross(b - a, c - a);
    EXPECT_NEAR(dot(nearest.point - a, normal), 0, 1e-12);
    EXPECT_GE(dot(cross(b - a, nearest.point - a), normal), -1e-12);
    EXPECT_GE(dot(cross(c - b, nearest.point - b), normal), -1e-12);
    EXPECT_GE(dot(cross(a - c, nearest.point - c), normal), -1e-12);
  }
  EXPECT_GT(*std::ranges::min_element(seen), 20);
}

/// The ramp of a distance, positive outside.
double ramp(double distance, double half_width) {
  return std::clamp(0.5 - distance / (2 * half_width), 0.0, 1.0);
}

TEST(DistanceRamp, FacesAreLinearAndEdgesAsPromised) {
  const Vec3 low{-6.3, -6.2, -6.1}, high{6.4, 6.2, 6.3};
  const TriangleMesh mesh = box_mesh(low, high);
  const volume::Grid round =
      antialiasing::jones_density(with(1), mesh, unit_lattice, voxelization::OpenMesh::refuse);
  const volume::Grid sharp =
      antialiasing::sramek_density(with(1), mesh, unit_lattice, voxelization::OpenMesh::refuse);
  volume::GridAccessor jones(round), sramek(sharp);
  std::size_t beyond_edges = 0;
  for (std::int32_t i = -10; i <= 10; ++i)
    for (std::int32_t j = -10; j <= 10; ++j)
      for (std::int32_t k = -10; k <= 10; ++k) {
        const Vec3 p{1.0 * i, 1.0 * j, 1.0 * k};
        double outside = 0, largest = -1e9;
        for (int a = 0; a < 3; ++a) {
          const double d = std::fmax(low[a] - p[a], p[a] - high[a]);
          largest = test::larger(largest, d);
          outside += d > 0 ? d * d : 0;
        }
        const double euclidean = largest > 0 ? std::sqrt(outside) : largest;
        beyond_edges += euclidean > largest && euclidean < 1;
        // Outside an edge the sharp ramp follows the planes.
        EXPECT_NEAR(at(jones, {i, j, k}), ramp(euclidean, antialiasing::jones_half_width), 1e-7);
        // The band ends at the Euclidean distance.
        const double wanted = euclidean < antialiasing::sramek_half_width
                                  ? ramp(largest, antialiasing::sramek_half_width)
                                  : euclidean < 0;
        EXPECT_NEAR(at(sramek, {i, j, k}), wanted, 1e-7) << i << ' ' << j << ' ' << k;
      }
  EXPECT_GT(beyond_edges, 20u);
  EXPECT_GT(std::fabs(at(jones, {7, 0, 0}) - at(sramek, {7, 0, 0})), 0.05); // negative control
}

TEST(DistanceRamp, BandIsTheSearchOverAllTriangles) {
  TriangleMesh mesh = sphere_mesh(1, 7, {0.3, -0.2, 0.1});
  rotate(mesh, 1);
  append(mesh, sphere_mesh(1, 3, {1, 0, 0}));
  antialiasing::CoverageReport report;
  const volume::Grid grid = antialiasing::jones_density(with(1), mesh, unit_lattice,
                                                        voxelization::OpenMesh::refuse, &report);
  const std::set<Int3> inside =
      inside_voxels(voxelization::scan_inside(with(1), mesh, unit_lattice, {}));
  volume::GridAccessor value(grid);
  double sum = 0;
  for (std::int32_t i = -10; i <= 10; ++i)
    for (std::int32_t j = -10; j <= 10; ++j)
      for (std::int32_t k = -10; k <= 10; ++k) {
        const Vec3 p{1.0 * i, 1.0 * j, 1.0 * k};
        double min = 1e9;
        for (const auto& [a, b, c] : mesh.triangles)
          min = test::smaller(min, norm(p - mesh::nearest_on_triangle(
                                                p, mesh.points[a], mesh.points[b], mesh.points[c])
                                                .point));
        const bool in = inside.contains({i, j, k});
        EXPECT_NEAR(at(value, {i, j, k}), ramp(in ? -min : min, antialiasing::jones_half_width),
                    1e-7);
        sum += at(value, {i, j, k});
      }
  EXPECT_NEAR(report.volume, sum, 1e-9 * sum);
  EXPECT_GT(report.surface_voxels, 500u);
}

TEST(DistanceRamp, LargeInteriorsKeepTheirTiles) {
  // The wall at 129.4 has its band in the leaf from 128 on, that at 127.6 in the last leaf of a
  // tile too: only tiles without it stay whole.
  for (const double wall : {129.4, 127.6}) {
    const TriangleMesh mesh = box_mesh({-10.2, -10.3, -10.4}, {140.2, 140.3, wall});
    antialiasing::CoverageReport round, sharp;
    for (const auto& [grid, report] :
         {std::pair(antialiasing::jones_density(with(2), mesh, unit_lattice,
                                                voxelization::OpenMesh::refuse, &round),
                    &round),
          std::pair(antialiasing::sramek_density(with(2), mesh, unit_lattice,
                                                 voxelization::OpenMesh::refuse, &sharp),
                    &sharp)}) {
      volume::GridAccessor value(grid);
      for (const Int3& v : {Int3{60, 60, 60}, Int3{0, 0, 125}, Int3{120, 120, 120}})
        EXPECT_EQ(value.value(v), 1.0f);
      EXPECT_EQ(value.value({60, 60, 133}), 0.0f);
      EXPECT_LT(value.value({60, 60, static_cast<std::int32_t>(wall)}), 1.0f);
      const double volume = volume::volume_stats(with(1), grid).volume;
      EXPECT_LT(std::fabs(volume / (150.4 * 150.6 * (wall + 10.4)) - 1), 1e-3);
      EXPECT_NEAR(report->volume, volume, 1e-9 * volume); // no voxel counts twice
    }
  }
}

TEST(DistanceRamp, SurfaceStaysWhereItIs) {
  // Along a lattice line through a plane in general position interpolation at ½ finds it again.
  TriangleMesh mesh = box_mesh({-12, -12, -12}, {12, 12, 4.3});
  rotate(mesh, 0.6);
  const Vec3 normal = [&] { // of the face z = 4.3
    const Vec3 n = cross(mesh.points[5] - mesh.points[4], mesh.points[6] - mesh.points[4]);
    return n / norm(n);
  }();
  const double height = dot(normal, mesh.points[4]);
  for (const bool sharp : {false, true}) {
    const volume::Grid grid = sharp ? antialiasing::sramek_density(with(1), mesh, unit_lattice,
                                                                   voxelization::OpenMesh::refuse)
                                    : antialiasing::jones_density(with(1), mesh, unit_lattice,
                                                                  voxelization::OpenMesh::refuse);
    volume::GridAccessor value(grid);
    for (std::int32_t i = -2; i <= 2; ++i)
      for (std::int32_t j = -2; j <= 2; ++j)
        for (std::int32_t k = -12; k < 12; ++k) {
          const double a = at(value, {i, j, k}), b = at(value, {i, j, k + 1});
          if ((a > 0.5) == (b > 0.5))
            continue;
          const double t = (a - 0.5) / (a - b);
          const Vec3 p{1.0 * i, 1.0 * j, k + t};
          if (dot(normal, p) > height - 1) {
            EXPECT_NEAR(dot(normal, p), height, 1e-6);
          }
        }
  }
}

TEST(DistanceRamp, NormalsOfASphereForEachFilter) {
  // What voxelize(1) says of its filters: angles between the normals of a ball's surface of 20
  // voxels and its radii, in degrees.
  const Vec3 center{0.3, -0.2, 0.1};
  const TriangleMesh mesh = sphere_mesh(5, 20, center);
  struct Case {
    const char* filter;
    volume::Grid grid;
    double mean, p99;
  };
  voxelization::VoxelizeOptions box;
  box.samples = 4;
  const auto refuse = voxelization::OpenMesh::refuse;
  std::vector<Case> cases;
  cases.push_back(
      {"jones", antialiasing::jones_density(with(1), mesh, unit_lattice, refuse), 1.4, 5.5});
  cases.push_back(
      {"sramek", antialiasing::sramek_density(with(1), mesh, unit_lattice, refuse), 0.05, 0.12});
  cases.push_back(
      {"exact", *antialiasing::exact_coverage(with(1), mesh, unit_lattice, refuse), 7.5, 17});
  cases.push_back({"box:4", voxelization::voxelize(with(1), mesh, unit_lattice, box), 7.6, 18});
  cases.push_back({"none", voxelization::voxelize(with(1), mesh, unit_lattice, {}), 15, 42});
  cases.push_back({"winding",
                   antialiasing::jones_density(with(1), mesh, unit_lattice, refuse, nullptr,
                                               voxelization::VoxelRule::winding),
                   1.4, 5.5});
  cases.push_back({"zbuffer",
                   antialiasing::jones_density(with(1), mesh, unit_lattice, refuse, nullptr,
                                               voxelization::VoxelRule::zbuffer),
                   1.4, 5.5});
  for (const Case& c : cases) {
    TriangleMesh surface = surface::marching_cubes(with(1), c.grid).mesh;
    surface::gradient_normals(with(1), c.grid, surface);
    std::vector<double> angles;
    double sum = 0;
    for (std::size_t i = 0; i < surface.points.size(); ++i) {
      const Vec3 out = surface.points[i] - center;
      const auto [x, y, z] = surface.normals[i];
      const Vec3 normal{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
      const double turned = norm(cross(normal, out)) / norm(out);
      angles.push_back(std::asin(std::fmin(1, turned)) * 180 / M_PI);
      sum += angles.back();
    }
    std::ranges::sort(angles);
    const double mean = sum / static_cast<double>(angles.size()),
                 p99 = angles[angles.size() * 99 / 100];
    EXPECT_TRUE(mean <= c.mean && mean >= c.mean / 2) << c.filter << ' ' << mean;
    EXPECT_TRUE(p99 <= c.p99 && p99 >= c.p99 / 2) << c.filter << ' ' << p99;
  }
}

TEST(DistanceRamp, OtherRulesGiveTheSign) {
  // An open box is one to the winding rule; beside its hole, where no face is, it is as by parity.
  TriangleMesh open = box_mesh({0.2, 0.2, 0.2}, {10.2, 1.3, 5.5});
  const volume::Grid whole =
      antialiasing::jones_density(with(1), open, unit_lattice, voxelization::OpenMesh::refuse);
  open.triangles.erase(open.triangles.begin());
  EXPECT_THROW(
      antialiasing::jones_density(with(1), open, unit_lattice, voxelization::OpenMesh::refuse),
      Error);
  antialiasing::CoverageReport report;
  const volume::Grid film =
      antialiasing::jones_density(with(1), open, unit_lattice, voxelization::OpenMesh::refuse,
                                  &report, voxelization::VoxelRule::winding);
  EXPECT_EQ(report.mesh.boundary_edges, 3u);
  volume::GridAccessor a(film), b(whole);
  for (std::int32_t i = -1; i < 12; ++i)
    for (std::int32_t j = -1; j < 12; ++j)
      for (std::int32_t k = 3; k < 12; ++k)
        EXPECT_EQ(at(a, {i, j, k}), at(b, {i, j, k})) << i << ' ' << j << ' ' << k;
  // Solids that overlap are one: no value of it falls below ½ inside.
  TriangleMesh two = sphere_mesh(3, 8, {0.3, 0, 0});
  append(two, sphere_mesh(3, 8, {6.3, 0, 0}));
  const volume::Grid one =
      antialiasing::jones_density(with(1), two, unit_lattice, voxelization::OpenMesh::refuse,
                                  nullptr, voxelization::VoxelRule::winding);
  volume::GridAccessor value(one);
  for (std::int32_t i = -5; i <= 11; ++i)
    EXPECT_GE(at(value, {i, 0, 0}), 0.5);
  const volume::Grid hollow =
      antialiasing::jones_density(with(1), two, unit_lattice, voxelization::OpenMesh::refuse);
  EXPECT_EQ(volume::GridAccessor(hollow).value({3, 0, 0}),
            0.0f); // parity leaves the common part out
}

/// Points of the boundary of a union of boxes: a fine lattice on each face, less what lies strictly
/// within a box or on the wall between two that touch.
std::vector<Vec3> boundary_samples(const std::vector<std::array<Vec3, 2>>& boxes) {
  constexpr int steps = 80;
  const auto solid = [&](const Vec3& p) {
    return std::ranges::any_of(boxes, [&](const std::array<Vec3, 2>& box) {
      bool in = true;
      for (int a = 0; a < 3; ++a)
        in = in && p[a] > box[0][a] && p[a] < box[1][a];
      return in;
    });
  };
  std::vector<Vec3> samples;
  for (const auto& [low, high] : boxes)
    for (int axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true}) {
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        for (int m = 0; m <= steps; ++m)
          for (int n = 0; n <= steps; ++n) {
            Vec3 p, out;
            p[axis] = upper ? high[axis] : low[axis];
            p[b] = low[b] + m * (high[b] - low[b]) / steps;
            p[c] = low[c] + n * (high[c] - low[c]) / steps;
            out = p;
            out[axis] += upper ? 1e-4 : -1e-4;
            if (!solid(p) && !solid(out))
              samples.push_back(p);
          }
      }
  return samples;
}

TEST(DistanceRamp, FacesInsideTheWindingSolidDoNotCount) {
  using Boxes = std::vector<std::array<Vec3, 2>>;
  const Boxes overlap{{Vec3{-5.3, -4.2, -3.1}, Vec3{1.4, 2.2, 3.3}},
                      {Vec3{-1.6, -1.3, -5.2}, Vec3{5.2, 5.1, 1.7}}};
  const Boxes touching{{Vec3{-5.3, -3.2, -3.1}, Vec3{0.4, 3.2, 3.3}},
                       {Vec3{0.4, -1.6, -1.3}, Vec3{5.2, 5.3, 3.3}}};
  const Boxes within{{Vec3{-5.3, -4.2, -4.1}, Vec3{5.4, 4.2, 4.3}},
                     {Vec3{-4.7, -3.6, -2.2}, Vec3{4.9, 3.9, 3.8}}};
  const Boxes thin{{Vec3{-5.3, -3.2, -3.1}, Vec3{0.45, 3.2, 3.3}},
                   {Vec3{0.1, -3.9, -3.8}, Vec3{5.2, 3.3, 3.4}}};
  for (const Boxes& boxes : {overlap, touching, within, thin}) {
    TriangleMesh mesh;
    for (const auto& [low, high] : boxes)
      append(mesh, box_mesh(low, high));
    const std::vector<Vec3> boundary = boundary_samples(boxes);
    const volume::Grid grid =
        antialiasing::jones_density(with(1), mesh, unit_lattice, voxelization::OpenMesh::refuse,
                                    nullptr, voxelization::VoxelRule::winding);
    const volume::Grid sharp =
        antialiasing::sramek_density(with(1), mesh, unit_lattice, voxelization::OpenMesh::refuse,
                                     nullptr, voxelization::VoxelRule::winding);
    volume::GridAccessor value(grid), sramek(sharp);
    for (std::int32_t i = -7; i <= 7; ++i)
      for (std::int32_t j = -7; j <= 7; ++j)
        for (std::int32_t k = -7; k <= 7; ++k) {
          const Vec3 p{1.0 * i, 1.0 * j, 1.0 * k};
          double squared = 1e9;
          for (const Vec3& q : boundary)
            squared = test::smaller(squared, dot(p - q, p - q));
          const bool in = at(value, {i, j, k}) > 0.5;
          const double distance = std::sqrt(squared);
          EXPECT_NEAR(at(value, {i, j, k}),
                      ramp(in ? -distance : distance, antialiasing::jones_half_width), 0.04)
              << i << ' ' << j << ' ' << k;
          if (in) {
            EXPECT_GE(at(sramek, {i, j, k}), 0.5 + std::fmin(0.5, distance / 6.3) - 0.04)
                << i << ' ' << j << ' ' << k; // planes may be nearer by a factor of sqrt(3)
          }
        }
  }
  // Faces of many small triangles, one way as another round.
  TriangleMesh two = sphere_mesh(4, 8, {0.3, 0, 0});
  append(two, sphere_mesh(3, 8, {6.3, 0, 0}));
  std::swap(two.triangles[7][1], two.triangles[7][2]);
  for (std::size_t n = two.triangles.size() / 2; n < two.triangles.size(); ++n)
    std::swap(two.triangles[n][1], two.triangles[n][2]);
  const volume::Grid one =
      antialiasing::jones_density(with(1), two, unit_lattice, voxelization::OpenMesh::refuse,
                                  nullptr, voxelization::VoxelRule::winding);
  volume::GridAccessor value(one);
  for (std::int32_t i = -10; i <= 16; ++i)
    for (std::int32_t j = -9; j <= 9; ++j)
      for (std::int32_t k = -9; k <= 9; ++k) {
        const Vec3 p{1.0 * i, 1.0 * j, 1.0 * k};
        const Vec3 c[2] = {{0.3, 0, 0}, {6.3, 0, 0}};
        const double a = 8 - norm(p - c[0]), b = 8 - norm(p - c[1]);
        if (std::fabs(std::fmax(a, b)) < 0.1)
          continue; // the spheres are polyhedra
        double inside = std::fmax(a, b);
        if (inside > 0) { // to the circle in which they meet, or to a sphere outside the other
          inside = std::hypot(p.x - 3.3, std::sqrt(64.0 - 9) - std::hypot(p.y, p.z));
          for (const int n : {0, 1}) {
            const Vec3 q = c[n] + (p - c[n]) * (8 / norm(p - c[n]));
            if (norm(q - c[1 - n]) > 8)
              inside = test::smaller(inside, n == 0 ? a : b);
          }
        }
        EXPECT_NEAR(at(value, {i, j, k}), ramp(-inside, antialiasing::jones_half_width), 0.09)
            << i << ' ' << j << ' ' << k;
      }
}

TEST(DistanceRamp, SameBytesForAnyThreads) {
  const TriangleMesh mesh = sphere_mesh(3, 40, {0.3, 0.1, 0.2});
  EXPECT_EQ(antialiasing::jones_density(with(1), mesh, unit_lattice, voxelization::OpenMesh::refuse)
                .digest(),
            antialiasing::jones_density(with(2), mesh, unit_lattice, voxelization::OpenMesh::refuse)
                .digest());
  EXPECT_EQ(
      antialiasing::sramek_density(with(1), mesh, unit_lattice, voxelization::OpenMesh::refuse)
          .digest(),
      antialiasing::sramek_density(with(2), mesh, unit_lattice, voxelization::OpenMesh::refuse)
          .digest());
}

// Needles meet many leaves with little area: neither their area nor the longest of them tells how
// much they need.
TEST(DistanceRamp, NeedlesHoldTheLimitOfMemory) {
  TriangleMesh mesh;
  for (std::uint32_t n = 0; n < 64; ++n) {
    const double x = 40 * n;
    const std::uint32_t first = 4 * n;
    mesh.points.insert(mesh.points.end(),
                       {{x, 0, 0}, {x + 0.05, 0, 0}, {x, 0.05, 0}, {x + 0.01, 0.01, 3e4}});
    for (const Triangle& t : {Triangle{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}})
      mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  Context context;
  context.max_memory = std::uint64_t{300} << 20;
  const volume::GridTransform voxels = volume::uniform_transform(1);
  const auto refused = [&](auto&& work) {
    try {
      (void)work();
      ADD_FAILURE() << "not refused";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("--max-memory"), std::string::npos) << error.what();
    }
  };
  refused([&] {
    return antialiasing::jones_density(context, mesh, voxels, voxelization::OpenMesh::refuse,
                                       nullptr);
  });
  refused([&] {
    return antialiasing::exact_coverage(context, mesh, voxels, voxelization::OpenMesh::refuse,
                                        nullptr);
  });
  mesh.triangles.resize(8); // two of them are no problem
  EXPECT_GT(
      antialiasing::jones_density(context, mesh, voxels, voxelization::OpenMesh::refuse, nullptr)
          .active_voxels(),
      1000u);
}

TEST(DistanceRamp, OpenMeshesAndNeedles) {
  TriangleMesh open = box_mesh({0.2, 0.2, 0.2}, {10.2, 10.2, 10.2});
  open.triangles.erase(open.triangles.begin(), open.triangles.begin() + 2);
  EXPECT_THROW(
      antialiasing::jones_density(with(1), open, unit_lattice, voxelization::OpenMesh::refuse),
      Error);
  const volume::Grid filled =
      antialiasing::jones_density(with(1), open, unit_lattice, voxelization::OpenMesh::fill);
  const volume::Grid whole =
      antialiasing::jones_density(with(1), box_mesh({0.2, 0.2, 0.2}, {10.2, 10.2, 10.2}),
                                  unit_lattice, voxelization::OpenMesh::refuse);
  volume::GridAccessor a(filled), b(whole);
  for (std::int32_t i = -1; i < 12; ++i)
    for (std::int32_t k = -1; k < 12; ++k)
      EXPECT_NEAR(at(a, {i, 5, k}), at(b, {i, 5, k}), 1e-6);
  const volume::Grid skipped =
      antialiasing::sramek_density(with(1), open, unit_lattice, voxelization::OpenMesh::skip);
  EXPECT_LE(volume::volume_stats(with(1), skipped).max, 0.5); // nothing is inside
  TriangleMesh needle; // no area to speak of: values stay finite
  needle.points = {{-3, -3, -3}, {3, 3, 3}, {0, 0, 0}, {0, 0, 1e-13}};
  needle.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  const volume::VolumeStats stats =
      volume::volume_stats(with(1), antialiasing::sramek_density(with(1), needle, unit_lattice,
                                                                 voxelization::OpenMesh::refuse));
  EXPECT_GE(stats.min, 0);
  EXPECT_LE(stats.max, 1);
}

} // namespace
