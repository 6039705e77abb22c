// Sheets and half-edges against CGAL's, number by number, and many faces round one point.

#include "mesh/sheets.h"

#include "mesh/edges.h"
#include "mesh_fixtures.h"

#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace gewebe::test {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Point = CGAL::Simple_cartesian<double>::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

struct Copies : pmp::Default_orientation_visitor {
  explicit Copies(mesh::Sheets& sheets) : sheets_(&sheets) {}
  void duplicated_vertex(std::size_t from, std::size_t) {
    sheets_->origin.push_back(sheets_->origin[from]);
  }
  void polygon_orientation_reversed(std::size_t face) { sheets_->backward[face] ^= 1; }

private:
  mesh::Sheets* sheets_;
};

mesh::Sheets cgal_sheets(std::size_t points, const std::vector<Triangle>& triangles) {
  std::vector<Point> at(points, Point(0, 0, 0));
  std::vector<std::array<std::size_t, 3>> faces;
  for (const auto& [a, b, c] : triangles)
    faces.push_back({a, b, c});
  mesh::Sheets sheets;
  sheets.backward.assign(triangles.size(), 0);
  for (std::uint32_t p = 0; p < points; ++p)
    sheets.origin.push_back(p);
  pmp::orient_polygon_soup(at, faces, CGAL::parameters::visitor(Copies(sheets)));
  for (const auto& [a, b, c] : faces)
    sheets.triangles.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b),
                                static_cast<std::uint32_t>(c)});
  return sheets;
}

mesh::HalfEdges cgal_half_edges(std::size_t points, const std::vector<Triangle>& triangles) {
  Mesh mesh;
  for (std::size_t p = 0; p < points; ++p)
    mesh.add_vertex({0, 0, 0});
  for (const auto& [a, b, c] : triangles)
    EXPECT_NE(mesh.add_face(Mesh::Vertex_index(a), Mesh::Vertex_index(b), Mesh::Vertex_index(c)),
              Mesh::null_face());
  mesh::HalfEdges out;
  for (const auto h : mesh.halfedges()) {
    out.target.push_back(mesh.target(h));
    out.next.push_back(mesh.next(h));
    out.face.push_back(mesh.face(h));
  }
  for (const auto v : mesh.vertices())
    out.of_point.push_back(mesh.halfedge(v));
  for (const auto f : mesh.faces())
    out.of_face.push_back(mesh.halfedge(f));
  return out;
}

/// The soup's faces without those of equal corners, in any order and turned at random.
std::vector<Triangle> shuffled(std::vector<Triangle> triangles, std::mt19937& random,
                               bool turn_some) {
  std::erase_if(triangles, mesh::has_equal_corners);
  std::shuffle(triangles.begin(), triangles.end(), random);
  for (Triangle& t : triangles)
    if (turn_some && random() % 3 == 0)
      std::swap(t[0], t[1]);
  return triangles;
}

/// A strip that closes with a half turn: it has one side.
std::vector<Triangle> moebius(std::uint32_t count) {
  std::vector<Triangle> triangles;
  for (std::uint32_t n = 0; n < count; ++n)
    triangles.push_back({n, (n + 1) % count, (n + 2) % count});
  return triangles;
}

/// Two cones over one rim; their tips are points 0 and 1.
std::vector<Triangle> double_cone(std::uint32_t count) {
  std::vector<Triangle> triangles;
  for (std::uint32_t n = 0; n < count; ++n) {
    const std::uint32_t a = 2 + n, b = 2 + (n + 1) % count;
    triangles.push_back({0, a, b});
    triangles.push_back({1, b, a});
  }
  return triangles;
}

void expect_as_cgal(std::size_t points, const std::vector<Triangle>& triangles) {
  const mesh::Sheets own = mesh::cut_into_sheets(points, triangles),
                     cgal = cgal_sheets(points, triangles);
  ASSERT_EQ(own.backward, cgal.backward);
  ASSERT_EQ(own.origin, cgal.origin);
  ASSERT_EQ(own.triangles, cgal.triangles);
  const mesh::HalfEdges links = mesh::half_edges(own.origin.size(), own.triangles);
  const mesh::HalfEdges from = cgal_half_edges(own.origin.size(), own.triangles);
  ASSERT_EQ(links.target, from.target);
  ASSERT_EQ(links.next, from.next);
  ASSERT_EQ(links.face, from.face);
  ASSERT_EQ(links.of_point, from.of_point);
  ASSERT_EQ(links.of_face, from.of_face);
}

TEST(Sheets, AreThoseOfCgalNumberByNumber) {
  std::mt19937 random(7);
  std::uint64_t copies = 0, turned = 0;
  for (int n = 0; n < 2000; ++n) {
    // Few points under many faces, so that edges of three faces and pinched points are common.
    const auto points = static_cast<std::uint32_t>(4 + random() % 20);
    std::vector<Triangle> triangles(random() % 60);
    for (Triangle& t : triangles)
      for (std::uint32_t& corner : t)
        corner = static_cast<std::uint32_t>(random() % points);
    triangles = shuffled(triangles, random, true);
    SCOPED_TRACE(n);
    ASSERT_NO_FATAL_FAILURE(expect_as_cgal(points, triangles));
    const mesh::Sheets sheets = mesh::cut_into_sheets(points, triangles);
    copies += sheets.origin.size() - points;
    turned += static_cast<std::uint64_t>(std::ranges::count(sheets.backward, char{1}));
  }
  EXPECT_GT(copies, 10000U);
  EXPECT_GT(turned, 5000U);
  for (const std::uint32_t count : {5U, 6U, 40U, 41U}) {
    expect_as_cgal(count, moebius(count));
    expect_as_cgal(count, shuffled(moebius(count), random, true));
    expect_as_cgal(count + 2, double_cone(count));
    expect_as_cgal(count + 2, shuffled(double_cone(count), random, true));
  }
  const TriangleMesh ball = test::sphere_mesh(3, 10, {3, -2, 1});
  for (const std::size_t left_out : {0U, 1U, 100U, 700U}) {
    std::vector<Triangle> triangles = shuffled(ball.triangles, random, true);
    triangles.resize(triangles.size() - left_out);
    expect_as_cgal(ball.points.size(), triangles);
  }
  expect_as_cgal(3, {});
}

} // namespace
} // namespace gewebe::test
