#include "mesh/components.h"

#include "mesh/check.h"
#include "tests/unit/mesh_fixtures.h"

#include <gtest/gtest.h>

namespace gewebe::test {
namespace {

using test::append;
using test::box_mesh;

/// Cubes with edges 1, 3, 2, 3 in this order, and a cavity of edge 1.5 in the first of the large.
TriangleMesh cubes() {
  TriangleMesh mesh = box_mesh({0, 0, 0}, {1, 1, 1});
  append(mesh, box_mesh({5, 0, 0}, {8, 3, 3}));
  append(mesh, box_mesh({0, 5, 0}, {2, 7, 2}));
  append(mesh, box_mesh({5, 5, 5}, {8, 8, 8}));
  TriangleMesh cavity = box_mesh({6, 1, 1}, {7.5, 2.5, 2.5});
  for (Triangle& t : cavity.triangles)
    std::swap(t[1], t[2]);
  append(mesh, cavity);
  mesh.points.push_back({9, 9, 9}); // no face
  for (std::size_t p = 0; p < mesh.points.size(); ++p)
    mesh.normals.push_back({static_cast<float>(p), 0, 0});
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    mesh.part.push_back(static_cast<std::int32_t>(f));
  return mesh;
}

TEST(Components, LargestOfEqualIsTheFirst) {
  TriangleMesh mesh = cubes();
  const mesh::ComponentReport report = mesh::keep_components(mesh, {.largest = 1});
  EXPECT_EQ(report.kept, 1U);
  EXPECT_EQ(report.dropped, 4U);
  EXPECT_EQ(report.dropped_points, 33U);
  EXPECT_EQ(report.dropped_triangles, 48U);
  EXPECT_NEAR(report.dropped_volume, 1 + 8 + 27 + 3.375, 1e-12);
  EXPECT_NEAR(report.largest_dropped, 27, 1e-12);
  check_mesh(mesh);
  const mesh::MeshReport left = mesh::examine_mesh(mesh);
  EXPECT_EQ(left.components, 1U);
  EXPECT_NEAR(left.volume, 27, 1e-12);
  EXPECT_EQ(mesh.points.front(), (Vec3{5, 0, 0}));
  EXPECT_EQ(mesh.normals.front()[0], 8.0F); // arrays follow their points and faces
  EXPECT_EQ(mesh.part.front(), 12);
}

TEST(Components, ByNumberAndByVolume) {
  TriangleMesh three = cubes();
  EXPECT_EQ(mesh::keep_components(three, {.largest = 3}).kept, 3U);
  EXPECT_NEAR(signed_volume(three), 27 + 8 + 27, 1e-9);
  TriangleMesh large = cubes();
  EXPECT_EQ(mesh::keep_components(large, {.min_volume = 3}).dropped,
            1U); // the cavity counts by magnitude
  EXPECT_NEAR(signed_volume(large), 27 + 8 + 27 - 3.375, 1e-9);
  TriangleMesh none = cubes();
  EXPECT_EQ(mesh::keep_components(none, {.min_volume = 100}).kept, 0U);
  EXPECT_TRUE(none.points.empty() && none.triangles.empty() && none.normals.empty());
}

TEST(Components, KeepsAllByDefault) {
  TriangleMesh mesh = cubes();
  const auto faces = mesh.triangles;
  const mesh::ComponentReport report = mesh::keep_components(mesh, {});
  EXPECT_EQ(report.kept, 5U);
  EXPECT_EQ(report.dropped_points, 1U); // that no face uses
  EXPECT_EQ(mesh.triangles, faces);
  TriangleMesh empty;
  EXPECT_EQ(mesh::keep_components(empty, {.largest = 1}).kept, 0U);
}

} // namespace
} // namespace gewebe::test
