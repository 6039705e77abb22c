// Self-intersections as we find them, and as CGAL does.

#include "mesh/self_intersections.h"

#include "tests/unit/mesh_fixtures.h"
#include "tests/unit/surface_scenes.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <gtest/gtest.h>

namespace gewebe::test {
namespace {

using test::append;
using test::box_mesh;
using test::sphere_mesh;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

/// Pairs that CGAL finds. \pre manifold
std::size_t cgal_pairs(const TriangleMesh& mesh) {
  Mesh result;
  for (const Vec3& p : mesh.points)
    result.add_vertex({p.x, p.y, p.z});
  for (const auto& [a, b, c] : mesh.triangles)
    EXPECT_NE(result.add_face(Mesh::Vertex_index(a), Mesh::Vertex_index(b), Mesh::Vertex_index(c)),
              Mesh::null_face());
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs;
  CGAL::Polygon_mesh_processing::self_intersections(result, std::back_inserter(pairs));
  return pairs.size();
}

void expect_equal(const TriangleMesh& mesh, bool some) {
  const mesh::SelfIntersections found = mesh::self_intersections({}, mesh);
  EXPECT_EQ(found.pairs, cgal_pairs(mesh));
  EXPECT_EQ(found.pairs > 0, some);
  EXPECT_EQ(found.degenerate_faces, 0U);
}

TEST(SelfIntersectionsCgal, Bodies) {
  expect_equal(sphere_mesh(3, 5, {0.1, 0.2, 0.3}), false);
  TriangleMesh two = sphere_mesh(2, 5, {0, 0, 0});
  append(two, sphere_mesh(2, 5, {4.1, 0.3, 0.2}));
  expect_equal(two, true);
  TriangleMesh touching = box_mesh({0, 0, 0}, {1, 1, 1});
  append(touching, box_mesh({1, 0, 0}, {2, 1, 1})); // share a face in space
  expect_equal(touching, true);
  TriangleMesh at_corner = box_mesh({0, 0, 0}, {1, 1, 1});
  append(at_corner, box_mesh({1, 1, 1}, {2, 2, 2}));
  expect_equal(at_corner, true);
  TriangleMesh apart = box_mesh({0, 0, 0}, {1, 1, 1});
  append(apart, box_mesh({1 + 1e-15, 1, 1}, {2, 2, 2}));
  expect_equal(apart, false);
}

TEST(SelfIntersectionsCgal, FoldsAndDents) {
  TriangleMesh dent = sphere_mesh(2, 5, {0, 0, 0});
  dent.points[7] = dent.points[7] * -1.1; // out on the other side
  expect_equal(dent, true);
  TriangleMesh flat; // two triangles folded onto each other, closed by walls below
  flat.points = {{0, 0, 0}, {4, 0, 0}, {1, 3, 0}, {2, 1, 0}, {2, 1, -3}};
  flat.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}};
  expect_equal(flat, true);
}

TEST(SelfIntersectionsCgal, MeshesOfNoise) {
  std::size_t with = 0;
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const surface::IsoSurface surface = surface::marching_cubes({}, scenes::noise(8, seed));
    for (const double epsilon : {0.0, 0.3, 0.5}) {
      TriangleMesh mesh = surface::snap({}, surface, {epsilon}).mesh;
      std::mt19937 random(seed);
      for (Vec3& p : mesh.points) // shaken, and at a scale beyond a float's
        for (int a = 0; a < 3; ++a)
          p[a] = 1e-12 * (p[a] + static_cast<double>(random() % 1000) / 2500);
      const mesh::SelfIntersections found = mesh::self_intersections({}, mesh);
      EXPECT_EQ(found.pairs, cgal_pairs(mesh)) << seed << ", epsilon " << epsilon;
      with += found.pairs > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(with, 0U); // the test has something to see
}

TEST(SelfIntersections, SameForAnyThreadCount) {
  const TriangleMesh mesh =
      surface::snap({}, surface::marching_cubes({}, scenes::noise(20, 3)), {0.5}).mesh;
  Context one, three;
  one.threads = 1;
  three.threads = 3;
  const mesh::SelfIntersections a = mesh::self_intersections(one, mesh),
                                b = mesh::self_intersections(three, mesh);
  EXPECT_EQ(a.faces, b.faces);
  EXPECT_EQ(a.pairs, b.pairs);
  EXPECT_EQ(a.pairs_tested, b.pairs_tested);
}

TEST(SelfIntersections, CountsDegenerateFaces) {
  TriangleMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 1, 1}, {3, 3, 3}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}};
  EXPECT_EQ(mesh::self_intersections({}, mesh).degenerate_faces, 1U);
  EXPECT_EQ(mesh::self_intersections({}, {}).pairs, 0U);
}

} // namespace
} // namespace gewebe::test
