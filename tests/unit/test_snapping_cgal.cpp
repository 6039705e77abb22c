// The meshes of marching cubes and snapping, judged by CGAL.

#include "tests/unit/surface_scenes.h"

#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/boost/graph/helpers.h>

#include <gtest/gtest.h>

namespace gewebe {
namespace {

using namespace scenes;
namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

struct Verdict {
  bool manifold = false, closed = false;
  bool outward = false; ///< every component, nested ones alternating
};

Verdict judge(const TriangleMesh& mesh) {
  std::vector<Kernel::Point_3> points;
  std::vector<std::array<std::size_t, 3>> faces;
  for (const Vec3& p : mesh.points)
    points.emplace_back(p.x, p.y, p.z);
  for (const Triangle& t : mesh.triangles)
    faces.push_back({t[0], t[1], t[2]});
  Verdict verdict;
  verdict.manifold = pmp::is_polygon_soup_a_polygon_mesh(faces);
  if (!verdict.manifold)
    return verdict;
  Mesh result;
  pmp::polygon_soup_to_polygon_mesh(points, faces, result);
  verdict.manifold = CGAL::is_valid_polygon_mesh(result) && result.is_valid(false);
  verdict.closed = CGAL::is_closed(result) && CGAL::is_triangle_mesh(result);
  return verdict;
}

/// For smooth scenes, whose meshes have no self-intersection.
bool faces_outward(const TriangleMesh& mesh) {
  std::vector<Kernel::Point_3> points;
  std::vector<std::array<std::size_t, 3>> faces;
  for (const Vec3& p : mesh.points)
    points.emplace_back(p.x, p.y, p.z);
  for (const Triangle& t : mesh.triangles)
    faces.push_back({t[0], t[1], t[2]});
  Mesh result;
  pmp::polygon_soup_to_polygon_mesh(points, faces, result);
  return CGAL::is_closed(result) && pmp::does_bound_a_volume(result) &&
         pmp::is_outward_oriented(result);
}

TEST(SnappingCgal, NoiseIsClosedAndManifold) {
  for (std::uint32_t seed = 0; seed < 16; ++seed) {
    const IsoSurface surface = marching_cubes({}, noise(10, seed, seed % 2 == 0 ? 0 : 4));
    for (const double epsilon : {0.0, 0.15, 0.35, 0.5}) {
      const Verdict verdict = judge(snap({}, surface, {.epsilon = epsilon}).mesh);
      EXPECT_TRUE(verdict.manifold && verdict.closed) << seed << ", epsilon " << epsilon;
    }
  }
}

TEST(SnappingCgal, NaiveSnappingFails) {
  int broken = 0;
  for (std::uint32_t seed = 0; seed < 8; ++seed)
    broken += judge(snap_naively(marching_cubes({}, noise(10, seed)), 0.15)).manifold ? 0 : 1;
  EXPECT_EQ(broken, 8);
}

TEST(SnappingCgal, MetaballsBoundAVolume) {
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const IsoSurface surface = marching_cubes({}, metaballs(20, seed));
    EXPECT_TRUE(faces_outward(surface.mesh));
    for (const double epsilon : {0.0, 0.15, 0.5})
      for (const auto place : {SnapOptions::Place::mean, SnapOptions::Place::corner})
        EXPECT_TRUE(faces_outward(snap({}, surface, {epsilon, place}).mesh)) << seed;
  }
}

TEST(SnappingCgal, TurnedFacesDoNotBoundAVolume) {
  TriangleMesh mesh = marching_cubes({}, metaballs(20, 1)).mesh;
  for (Triangle& t : mesh.triangles)
    std::swap(t[1], t[2]);
  EXPECT_FALSE(faces_outward(mesh));
}

TEST(SnappingCgal, CavityBoundsAVolume) {
  const Grid grid = sample({}, {-15, -15, -15}, {15, 15, 15}, [](int i, int j, int k) {
    const double r = std::sqrt(i * i + j * j + k * k);
    return 0.5 + std::min(12.3 - r, r - 7.1);
  });
  const TriangleMesh mesh = snap({}, marching_cubes({}, grid), {}).mesh;
  const Verdict verdict = judge(mesh);
  EXPECT_TRUE(verdict.manifold && verdict.closed);
  EXPECT_TRUE(faces_outward(mesh));
}

} // namespace
} // namespace gewebe
