// Each property of the mesh report, with a mesh that has it and one that doesn't.

#include "mesh/check.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>

namespace gewebe::test {
namespace {

/// Unit cube from `corner`, faces outward.
TriangleMesh cube(const Vec3& corner = {}, double size = 1) {
  TriangleMesh mesh;
  for (int c = 0; c < 8; ++c)
    mesh.points.push_back(corner + size * Vec3{static_cast<double>(c & 1),
                                               static_cast<double>(c >> 1 & 1),
                                               static_cast<double>(c >> 2)});
  for (const std::array<std::uint32_t, 4>& q : {std::array<std::uint32_t, 4>{0, 2, 3, 1},
                                                {4, 5, 7, 6},
                                                {0, 1, 5, 4},
                                                {2, 6, 7, 3},
                                                {0, 4, 6, 2},
                                                {1, 3, 7, 5}}) {
    mesh.triangles.push_back({q[0], q[1], q[2]});
    mesh.triangles.push_back({q[0], q[2], q[3]});
  }
  return mesh;
}

TriangleMesh flipped(TriangleMesh mesh) {
  for (Triangle& t : mesh.triangles)
    std::swap(t[1], t[2]);
  return mesh;
}

TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto offset = static_cast<std::uint32_t>(a.points.size());
  a.points.insert(a.points.end(), b.points.begin(), b.points.end());
  for (const Triangle& t : b.triangles)
    a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  return a;
}

/// n × n torus.
TriangleMesh torus(std::uint32_t n) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t j = 0; j < n; ++j) {
      const double u = 6.283185307179586 * i / n, v = 6.283185307179586 * j / n;
      const double r = 3 + std::cos(v);
      mesh.points.push_back({r * std::cos(u), r * std::sin(u), std::sin(v)});
      const auto at = [n](std::uint32_t a, std::uint32_t b) { return a % n * n + b % n; };
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

TEST(MeshCheck, CubeIsSound) {
  const mesh::MeshReport report = mesh::examine_mesh(cube());
  EXPECT_TRUE(report.closed() && report.manifold() && report.oriented() && report.outward());
  EXPECT_EQ(report.points, 8U);
  EXPECT_EQ(report.triangles, 12U);
  EXPECT_EQ(report.edges, 18U);
  EXPECT_EQ(report.euler, 2);
  EXPECT_EQ(report.components, 1U);
  EXPECT_DOUBLE_EQ(report.volume, 1);
  EXPECT_DOUBLE_EQ(report.area, 6);
  EXPECT_NEAR(report.smallest_angle, 45, 1e-10);
  EXPECT_DOUBLE_EQ(report.edge_min, 1);
  EXPECT_DOUBLE_EQ(report.edge_max, std::sqrt(2.0));
  EXPECT_NEAR(report.edge_mean, (12 + 6 * std::sqrt(2.0)) / 18, 1e-12);
  EXPECT_EQ(report.zero_area_faces + report.unused_points + report.duplicate_faces, 0U);
}

TEST(MeshCheck, VolumeFarFromTheOrigin) {
  EXPECT_NEAR(mesh::examine_mesh(cube({1e6, -2e6, 3e6})).volume, 1, 1e-9);
}

TEST(MeshCheck, TorusHasEulerNumberZero) {
  const mesh::MeshReport report = mesh::examine_mesh(torus(24));
  EXPECT_TRUE(report.closed() && report.manifold() && report.oriented() && report.outward());
  EXPECT_EQ(report.euler, 0);
}

TEST(MeshCheck, MissingFaceLeavesABoundary) {
  TriangleMesh mesh = cube();
  mesh.triangles.pop_back();
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  EXPECT_FALSE(report.closed());
  EXPECT_TRUE(report.manifold());
  EXPECT_EQ(report.boundary_edges, 3U);
  EXPECT_EQ(report.euler, 1);
}

TEST(MeshCheck, TurnedFaceIsMisoriented) {
  TriangleMesh mesh = cube();
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  EXPECT_TRUE(report.closed() && report.manifold());
  EXPECT_FALSE(report.oriented());
  EXPECT_EQ(report.misoriented_edges, 3U);
}

TEST(MeshCheck, ThirdFaceAtAnEdge) {
  TriangleMesh mesh = cube();
  mesh.points.push_back({2, 2, 2});
  mesh.triangles.push_back({0, 1, 8});
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  EXPECT_FALSE(report.manifold());
  EXPECT_EQ(report.nonmanifold_edges, 1U);
  EXPECT_EQ(report.nonmanifold_points, 0U);
}

TEST(MeshCheck, TwoFansAtAPoint) {
  TriangleMesh mesh = joined(cube(), cube({1, 1, 1}));
  for (Triangle& t : mesh.triangles) // weld (1,1,1)
    for (std::uint32_t& p : t)
      p = p == 8 ? 7 : p;
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  EXPECT_FALSE(report.manifold());
  EXPECT_EQ(report.nonmanifold_points, 1U);
  EXPECT_EQ(report.nonmanifold_edges, 0U);
  EXPECT_EQ(report.unused_points, 1U);
  EXPECT_EQ(report.components, 1U);
  EXPECT_EQ(report.euler, 3);
}

TEST(MeshCheck, DuplicateFace) {
  TriangleMesh mesh = cube();
  mesh.triangles.push_back({mesh.triangles[4][1], mesh.triangles[4][0], mesh.triangles[4][2]});
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  EXPECT_EQ(report.duplicate_faces, 1U);
  EXPECT_FALSE(report.manifold());
}

TEST(MeshCheck, DegenerateFaceTakesNoPartInAnythingElse) {
  TriangleMesh mesh = cube();
  mesh.triangles.push_back({3, 3, 5});
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  EXPECT_EQ(report.degenerate_faces, 1U);
  EXPECT_FALSE(report.manifold());
  EXPECT_TRUE(report.closed());
  EXPECT_EQ(report.euler, 2);
}

TEST(MeshCheck, FlatFace) {
  TriangleMesh mesh = cube();
  mesh.points[1] = {0.5, 0, 0}; // 0, 1, 5, 4: moved along an edge, still proper
  EXPECT_EQ(mesh::examine_mesh(mesh).zero_area_faces, 0U);
  mesh.points[1] = mesh.points[5] * 0.5; // on the line from 0 to 5
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  EXPECT_EQ(report.zero_area_faces, 1U);
  EXPECT_EQ(report.smallest_angle, 0);
}

TEST(MeshCheck, InvertedCubeFacesInward) {
  const mesh::MeshReport report = mesh::examine_mesh(flipped(cube()));
  EXPECT_TRUE(report.closed() && report.manifold() && report.oriented());
  EXPECT_FALSE(report.outward());
  EXPECT_EQ(report.inverted_components, 1U);
  EXPECT_DOUBLE_EQ(report.volume, -1);
}

TEST(MeshCheck, NestedShellsAlternate) {
  const TriangleMesh body = joined(cube({}, 9), flipped(cube({1, 1, 1}, 7)));
  const TriangleMesh kernel = joined(body, cube({3, 3, 3}, 2));
  const mesh::MeshReport report = mesh::examine_mesh(kernel);
  EXPECT_TRUE(report.outward());
  EXPECT_EQ(report.components, 3U);
  EXPECT_NEAR(report.volume, 729 - 343 + 8, 1e-9);
  // Inner shells that face the wrong way are found, in any order of the components.
  EXPECT_EQ(mesh::examine_mesh(joined(cube({}, 9), cube({1, 1, 1}, 7))).inverted_components, 1U);
  EXPECT_EQ(mesh::examine_mesh(joined(cube({1, 1, 1}, 7), cube({}, 9))).inverted_components, 1U);
  EXPECT_EQ(mesh::examine_mesh(flipped(kernel)).inverted_components, 3U);
  // Beside, above and below are not inside.
  for (const Vec3& corner : {Vec3{0, 0, 20}, Vec3{0, 0, -20}, Vec3{20, 0, 0}, Vec3{0, -20, 0}})
    EXPECT_TRUE(mesh::examine_mesh(joined(cube({}, 9), cube(corner, 3))).outward());
}

TEST(MeshCheck, EmptyMesh) {
  const mesh::MeshReport report = mesh::examine_mesh({});
  EXPECT_TRUE(report.closed() && report.manifold() && report.oriented() && report.outward());
  EXPECT_EQ(report.euler, 0);
  EXPECT_EQ(report.edge_min, 0);
}

TEST(MeshCheck, UnusedPoints) {
  TriangleMesh mesh = cube();
  mesh.points.push_back({5, 5, 5});
  const mesh::MeshReport report = mesh::examine_mesh(mesh);
  EXPECT_EQ(report.unused_points, 1U);
  EXPECT_EQ(report.euler, 2);
}

} // namespace
} // namespace gewebe::test
