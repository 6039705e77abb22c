#include "base/error.h"
#include "geometry/mesh.h"
#include "mesh/triangulate.h"
#include "repair/weld.h"
#include "tests/unit/complaint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

using namespace gewebe;

namespace {

// A unit cube at `corner`, every triangle with points of its own.
void add_cube_soup(TriangleMesh& mesh, Vec3 corner, std::int32_t part, bool without_top = false) {
  static constexpr int faces[6][4] = {{0, 2, 3, 1}, {0, 1, 5, 4}, {0, 4, 6, 2},
                                      {1, 3, 7, 5}, {2, 6, 7, 3}, {4, 5, 7, 6}};
  for (int f = 0; f < (without_top ? 5 : 6); ++f)
    for (const auto& t : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
      Triangle triangle{};
      for (std::size_t k = 0; k < 3; ++k) {
        const int c = faces[f][t[k]];
        triangle[k] = static_cast<std::uint32_t>(mesh.points.size());
        mesh.points.push_back(corner + Vec3{double(c & 1), double(c >> 1 & 1), double(c >> 2)});
      }
      mesh.triangles.push_back(triangle);
      mesh.part.push_back(part);
    }
}

std::size_t open_edges(const TriangleMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> half;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      half.insert({t[k], t[(k + 1) % 3]});
  return static_cast<std::size_t>(std::count_if(half.begin(), half.end(), [&](const auto& e) {
    return !half.contains({e.second, e.first});
  }));
}

repair::WeldResult weld_mode(TriangleMesh& mesh, repair::Weld mode) {
  repair::WeldOptions options;
  options.mode = mode;
  return repair::weld(mesh, options);
}

} // namespace

TEST(Mesh, VolumeAreaAndBoxOfACube) {
  TriangleMesh mesh;
  add_cube_soup(mesh, {1e6, -2e6, 3e6}, 0);
  EXPECT_EQ(signed_volume(mesh), 1);
  EXPECT_EQ(surface_area(mesh), 6);
  EXPECT_EQ(bounding_box(mesh).max, (Vec3{1e6 + 1, -2e6 + 1, 3e6 + 1}));
  for (Triangle& t : mesh.triangles)
    std::swap(t[0], t[1]);
  EXPECT_EQ(signed_volume(mesh), -1);
  EXPECT_EQ(signed_volume({}), 0);
  EXPECT_TRUE(bounding_box({}).empty());
}

TEST(Mesh, CheckNamesTheFirstOffender) {
  TriangleMesh good;
  add_cube_soup(good, {}, 0);
  EXPECT_NO_THROW(check_mesh(good));
  EXPECT_NO_THROW(check_mesh({}));
  const auto complaint = [&](auto spoil) {
    TriangleMesh mesh = good;
    spoil(mesh);
    return test::complaint([&] { check_mesh(mesh); });
  };
  EXPECT_EQ(complaint([](TriangleMesh& m) { m.triangles[3][1] = 36; }),
            "triangle 3 has corner 36, expected an index below 36");
  EXPECT_EQ(complaint([](TriangleMesh& m) { m.points[7].y = NAN; }),
            "point 7 is not finite, expected finite coordinates");
  EXPECT_NE(complaint([](TriangleMesh& m) { m.points[7].z = HUGE_VAL; }), "");
  EXPECT_NE(complaint([](TriangleMesh& m) { m.part.pop_back(); }), "");
  EXPECT_NE(complaint([](TriangleMesh& m) { m.part[2] = -1; }), "");
  EXPECT_NE(complaint([](TriangleMesh& m) { m.material.resize(1); }), "");
  EXPECT_NE(complaint([](TriangleMesh& m) { m.normals.resize(1); }), "");
  EXPECT_NE(complaint([](TriangleMesh& m) { m.texcoords.resize(1); }), "");
  EXPECT_NE(complaint([](TriangleMesh& m) { m.texcoords.resize(12, {0, 0, NAN, 0, 0, 0}); }), "");
}

TEST(Weld, SoupBecomesACube) {
  TriangleMesh mesh;
  add_cube_soup(mesh, {}, 0);
  EXPECT_EQ(open_edges(mesh), 36u); // the negative control
  const repair::WeldResult result = weld_mode(mesh, repair::Weld::borders);
  EXPECT_EQ(result.points_before, 36u);
  EXPECT_EQ(result.points_after, 8u);
  EXPECT_EQ(result.welded, 28u);
  EXPECT_EQ(result.welded_across_parts, 0u);
  EXPECT_EQ(mesh.points.size(), 8u);
  EXPECT_EQ(open_edges(mesh), 0u);
  EXPECT_EQ(signed_volume(mesh), 1);
  EXPECT_EQ(mesh.triangles[0], (Triangle{0, 1, 2})); // first occurrence first
}

TEST(Weld, TouchingClosedPartsStayApart) {
  TriangleMesh mesh;
  add_cube_soup(mesh, {0, 0, 0}, 0);
  add_cube_soup(mesh, {1, 0, 0}, 1); // four corners in common
  TriangleMesh by_part = mesh, all = mesh, none = mesh;
  EXPECT_EQ(weld_mode(mesh, repair::Weld::borders).points_after, 16u);
  EXPECT_EQ(weld_mode(by_part, repair::Weld::part).points_after, 16u);
  EXPECT_EQ(weld_mode(all, repair::Weld::all).points_after, 12u);
  EXPECT_EQ(weld_mode(none, repair::Weld::none).points_after, 72u);
}

TEST(Weld, PatchesOfOneSurfaceJoinAtTheirBorders) {
  // Two open boxes, each without its top, the second turned over onto the first, and a closed cube
  // that touches both: the boxes join along their rim, the cube stays alone.
  TriangleMesh mesh;
  add_cube_soup(mesh, {0, 0, 0}, 0, true);
  TriangleMesh lid;
  add_cube_soup(lid, {0, 0, 0}, 1, true);
  for (Triangle t : lid.triangles) {
    for (std::uint32_t& c : t)
      c += 30;
    std::swap(t[0], t[1]);
    mesh.triangles.push_back(t);
    mesh.part.push_back(1);
  }
  for (Vec3 p : lid.points)
    mesh.points.push_back({p.x, p.y, 2 - p.z});
  add_cube_soup(mesh, {1, 0, 0}, 2);
  TriangleMesh by_part = mesh;
  EXPECT_EQ(weld_mode(by_part, repair::Weld::part).points_after, 24u);
  EXPECT_EQ(open_edges(by_part), 8u);
  const repair::WeldResult result = weld_mode(mesh, repair::Weld::borders);
  EXPECT_EQ(result.points_after, 20u);
  EXPECT_EQ(result.welded_across_parts, 4u);
  EXPECT_EQ(open_edges(mesh), 0u);
  EXPECT_EQ(signed_volume(mesh), 3);
  EXPECT_EQ(weld_mode(mesh, repair::Weld::borders).welded, 0u); // again changes nothing
}

TEST(Weld, SharedPointsStayShared) {
  TriangleMesh mesh; // two triangles of two parts with a common edge in the indices
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 3}};
  mesh.part = {0, 1};
  EXPECT_EQ(weld_mode(mesh, repair::Weld::part).points_after, 4u);
  EXPECT_EQ(mesh.triangles[1], (Triangle{2, 1, 3}));
}

TEST(Weld, ZeroHasNoSign) {
  TriangleMesh mesh;
  mesh.points = {{0.0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0, 0, -0.0}, {0, 1, 0}, {-1, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  EXPECT_EQ(weld_mode(mesh, repair::Weld::borders).points_after, 4u);
}

TEST(Weld, DegenerateTrianglesAndUnusedPoints) {
  TriangleMesh mesh;
  mesh.points = {{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {5, 5, 5}};
  mesh.normals = {{9, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}};
  mesh.triangles = {{1, 4, 2}, {1, 2, 3}, {4, 2, 3}};
  mesh.part = {7, 8, 7};
  mesh.material = {1, 2, 3};
  mesh.texcoords = {{1}, {2}, {3}};
  TriangleMesh kept = mesh;
  repair::WeldOptions options;
  options.mode = repair::Weld::all;
  options.drop_unused = true;
  const repair::WeldResult result = repair::weld(mesh, options);
  EXPECT_EQ(result.degenerate_removed, 1u);
  EXPECT_EQ(result.unused_removed, 2u);
  EXPECT_EQ(result.welded, 1u);
  EXPECT_EQ(mesh.points, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.normals[2][0], 3);
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 2}})); // doubles stay
  EXPECT_EQ(mesh.part, (std::vector<std::int32_t>{8, 7}));
  EXPECT_EQ(mesh.material, (std::vector<std::int32_t>{2, 3}));
  EXPECT_EQ(mesh.texcoords[1][0], 3);

  options.drop_degenerate = options.drop_unused = false;
  EXPECT_EQ(repair::weld(kept, options).points_after, 5u);
  EXPECT_EQ(kept.triangles.size(), 3u);
  EXPECT_EQ(kept.points[0], (Vec3{9, 9, 9}));
}

// ---- triangulate

namespace {

Vec3 area_vector(const std::vector<Vec3>& polygon, const std::vector<Triangle>& triangles) {
  Vec3 sum;
  for (const Triangle& t : triangles)
    sum += 0.5 * cross(polygon[t[1]] - polygon[t[0]], polygon[t[2]] - polygon[t[0]]);
  return sum;
}

// n - 2 triangles, all turned like the polygon, which together have its area: a triangulation.
void expect_triangulation(const std::vector<Vec3>& polygon, Vec3 normal, double area) {
  std::vector<Triangle> triangles;
  mesh::triangulate_polygon(polygon, triangles);
  ASSERT_EQ(triangles.size(), polygon.size() - 2);
  double sum = 0;
  for (const Triangle& t : triangles) {
    const double part = dot(area_vector(polygon, {t}), normal);
    EXPECT_GE(part, -1e-12 * area);
    sum += std::fabs(part);
  }
  EXPECT_NEAR(sum, area, 1e-12 * area);
}

} // namespace

TEST(Triangulate, ConvexIsAFan) {
  std::vector<Triangle> triangles;
  mesh::triangulate_polygon(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
                            triangles);
  EXPECT_EQ(triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Triangulate, ConcaveInEveryPlaneAndOrientation) {
  const std::vector<Vec3> arrow{{0, 0, 0}, {4, -3, 0}, {1, 0, 0}, {4, 3, 0}};
  const std::vector<Vec3> comb{{0, 0, 0}, {5, 0, 0}, {5, 3, 0}, {4, 1, 0},
                               {3, 3, 0}, {2, 1, 0}, {1, 3, 0}, {0, 1, 0}};
  // The fan from corner 0 is wrong for the comb: what expect_triangulation must notice.
  double fan = 0;
  for (std::uint32_t i = 1; i + 1 < comb.size(); ++i)
    fan += std::fabs(area_vector(comb, {{0, i, i + 1}}).z);
  EXPECT_GT(fan, 10.5);
  for (int axis = 0; axis < 3; ++axis)
    for (const bool reversed : {false, true})
      for (const auto& [flat, area] : {std::pair(arrow, 3.0), std::pair(comb, 10.0)}) {
        std::vector<Vec3> polygon;
        for (const Vec3& p : flat) {
          Vec3 q;
          q[axis] = p.x;
          q[(axis + 1) % 3] = p.y;
          q[(axis + 2) % 3] = 0.25 * p.x; // leans
          polygon.push_back(q);
        }
        if (reversed)
          std::reverse(polygon.begin(), polygon.end());
        const Vec3 sum = area_vector(polygon, [&] {
          std::vector<Triangle> all;
          for (std::uint32_t i = 1; i + 1 < polygon.size(); ++i)
            all.push_back({0, i, i + 1});
          return all;
        }());
        EXPECT_NEAR(norm(sum), area * std::sqrt(1 + 0.0625), 1e-12);
        expect_triangulation(polygon, sum / norm(sum), norm(sum));
      }
}

TEST(Triangulate, CollinearCornersAreUsed) {
  const std::vector<Vec3> polygon{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {2, 2, 0}, {0, 2, 0}};
  std::vector<Triangle> triangles;
  mesh::triangulate_polygon(polygon, triangles);
  ASSERT_EQ(triangles.size(), 4u);
  std::set<std::uint32_t> used;
  for (const Triangle& t : triangles) {
    EXPECT_GT(area_vector(polygon, {t}).z, 0);
    used.insert(t.begin(), t.end());
  }
  EXPECT_EQ(used.size(), 6u);
}

TEST(Triangulate, RandomStarsAndGridPolygons) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> radius(0.1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 4 + trial % 60;
    std::vector<Vec3> polygon;
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * M_PI * i / n, r = radius(random);
      polygon.push_back({r * std::cos(angle), r * std::sin(angle), 0});
    }
    double area = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i)
      area += cross(polygon[i], polygon[(i + 1) % polygon.size()]).z / 2;
    expect_triangulation(polygon, {0, 0, 1}, area);
  }
  // Towers of whole-number heights on a common ground: many collinear and equal coordinates.
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Vec3> polygon;
    double area = 0;
    const int towers = 1 + trial % 30;
    for (int i = 0; i < towers; ++i) {
      const double height = 1 + static_cast<double>(random() % 5);
      polygon.push_back({double(i), height, 0});
      polygon.push_back({double(i + 1), height, 0});
      area += height;
    }
    for (int i = towers; i >= 0; --i)
      polygon.push_back({double(i), 0, 0});
    std::reverse(polygon.begin(), polygon.end());
    expect_triangulation(polygon, {0, 0, 1}, area);
  }
}

TEST(Triangulate, WithoutAreaOrTooLarge) {
  std::vector<Triangle> triangles;
  mesh::triangulate_polygon(std::vector<Vec3>(7, Vec3{1, 1, 1}), triangles);
  EXPECT_EQ(triangles.size(), 5u);
  triangles.clear();
  mesh::triangulate_polygon(std::vector<Vec3>{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}},
                            triangles);
  EXPECT_EQ(triangles.size(), 2u);
  EXPECT_THROW(
      mesh::triangulate_polygon(std::vector<Vec3>(mesh::max_polygon_corners + 1), triangles),
      Error);
}
