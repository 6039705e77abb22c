// The meshes of marching cubes and snapping, judged by CGAL.

#include "tests/unit/cgal_surface.h"
#include "tests/unit/sanitizers.h"
#include "tests/unit/surface_scenes.h"
#include "tests/unit/surface_stress.h"

#include <CGAL/Polygon_mesh_processing/orientation.h>

#include <gtest/gtest.h>

namespace gewebe::test {
namespace {

using namespace scenes;
using test::cgal_verdict;

/// For smooth scenes, whose meshes have no self-intersection.
bool faces_outward(const TriangleMesh& mesh) {
  namespace pmp = CGAL::Polygon_mesh_processing;
  test::CgalMesh surface;
  return cgal_verdict(mesh, &surface).closed && pmp::does_bound_a_volume(surface) &&
         pmp::is_outward_oriented(surface);
}

TEST(SnappingCgal, RandomScenesKeepTheirTopology) {
  // make stress looks at thousands; naive snapping is caught by each third (below).
  const std::size_t count = test::under_sanitizers() ? 12 : 60;
  std::vector<std::string> complaints(count);
  parallel_blocks({}, count, 1, [&](std::size_t n, std::size_t) {
    complaints[n] = stress_complaint(stress_scene(static_cast<std::uint32_t>(n)));
  });
  for (std::size_t n = 0; n < count; ++n)
    EXPECT_EQ(complaints[n], "") << "scene " << n;
}

TEST(SnappingCgal, NaiveSnappingFailsTheSameTest) {
  int ours = 0, cgal = 0;
  for (std::uint32_t n = 0; n < 40; ++n) {
    const surface::IsoSurface surface = surface::marching_cubes({}, stress_scene(n).grid);
    const TriangleMesh naive = snap_naively(surface, 0.35);
    ours += keeps_topology(mesh::examine_mesh(surface.mesh), mesh::examine_mesh(naive)) ? 0 : 1;
    cgal += cgal_verdict(naive) == cgal_verdict(surface.mesh) ? 0 : 1;
  }
  EXPECT_GT(ours, 12);
  EXPECT_EQ(cgal, ours); // and the two judges agree
}

TEST(SnappingCgal, MetaballsBoundAVolume) {
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const surface::IsoSurface surface = surface::marching_cubes({}, metaballs(20, seed));
    EXPECT_TRUE(faces_outward(surface.mesh));
    for (const double epsilon : {0.0, 0.15, 0.5})
      for (const auto place :
           {surface::SnapOptions::Place::mean, surface::SnapOptions::Place::corner})
        EXPECT_TRUE(faces_outward(surface::snap({}, surface, {epsilon, place}).mesh)) << seed;
  }
}

TEST(SnappingCgal, TurnedFacesDoNotBoundAVolume) {
  TriangleMesh mesh = surface::marching_cubes({}, metaballs(20, 1)).mesh;
  for (Triangle& t : mesh.triangles)
    std::swap(t[1], t[2]);
  EXPECT_FALSE(faces_outward(mesh));
}

TEST(SnappingCgal, CavityBoundsAVolume) {
  const volume::Grid grid = sample({}, {-15, -15, -15}, {15, 15, 15}, [](int i, int j, int k) {
    const double r = std::sqrt(i * i + j * j + k * k);
    return 0.5 + std::min(12.3 - r, r - 7.1);
  });
  const TriangleMesh mesh = surface::snap({}, surface::marching_cubes({}, grid), {}).mesh;
  const test::CgalVerdict verdict = cgal_verdict(mesh);
  EXPECT_TRUE(verdict.manifold && verdict.closed);
  EXPECT_TRUE(faces_outward(mesh));
}

} // namespace
} // namespace gewebe::test
