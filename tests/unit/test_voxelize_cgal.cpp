// Voxelization against CGAL's exact point-in-mesh test.

#include "base/error.h"
#include "mesh_fixtures.h"
#include "volume/lattice.h"
#include "volume/voxelize.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>
#include <gtest/gtest.h>

#include <random>

namespace {

using namespace gewebe;
using namespace gewebe::test;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

struct Comparison {
  std::size_t inside = 0, wrong = 0, on_surface = 0;
};

/// Compares all voxels around the mesh; the mesh goes to CGAL in index space as the voxelizer has
/// it.
Comparison compare(const TriangleMesh& mesh, const GridTransform& lattice,
                   const GridTransform& tested_lattice) {
  Mesh surface;
  Box3 box;
  std::vector<Mesh::Vertex_index> vertex;
  for (const Vec3& point : mesh.points) {
    const Vec3 p = lattice.to_index(point);
    box.add(p);
    vertex.push_back(surface.add_vertex({p.x, p.y, p.z}));
  }
  for (const auto& [a, b, c] : mesh.triangles)
    surface.add_face(vertex[a], vertex[b], vertex[c]);
  EXPECT_EQ(surface.number_of_faces(), mesh.triangles.size());
  const CGAL::Side_of_triangle_mesh<Mesh, Kernel> side(surface);

  const std::set<Int3> voxels = inside_voxels(scan_inside(Context{}, mesh, tested_lattice, {}));
  Int3 min{}, max{};
  EXPECT_TRUE(index_range(uniform_transform(1), box, min, max));
  Comparison result;
  for (std::int32_t i = min[0] - 1; i <= max[0] + 1; ++i)
    for (std::int32_t j = min[1] - 1; j <= max[1] + 1; ++j)
      for (std::int32_t k = min[2] - 1; k <= max[2] + 1; ++k) {
        const CGAL::Bounded_side where =
            side({static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)});
        const bool inside = voxels.contains({i, j, k});
        result.inside += inside;
        if (where == CGAL::ON_BOUNDARY)
          ++result.on_surface;
        else
          result.wrong += inside != (where == CGAL::ON_BOUNDED_SIDE);
      }
  return result;
}

TEST(VoxelizeCgal, RandomRotatedSolids) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(0, 6);
  for (int n = 0; n < 4; ++n) {
    TriangleMesh mesh = n % 2 == 0 ? box_mesh({-9, -5, -7}, {8, 11, 10}) : sphere_mesh(2, 15, {});
    if (n == 3) // spiky: every second point pulled in
      for (std::size_t p = 0; p < mesh.points.size(); p += 2)
        mesh.points[p] *= 0.4;
    rotate(mesh, angle(random));
    const Comparison result = compare(mesh, uniform_transform(1), uniform_transform(1));
    EXPECT_GT(result.inside, 1000u);
    EXPECT_EQ(result.wrong, 0u);
  }
}

TEST(VoxelizeCgal, PointsOnVoxelCentres) {
  TriangleMesh mesh = sphere_mesh(2, 12, {});
  for (Vec3& p : mesh.points)
    p = {std::round(p.x), std::round(p.y), std::round(p.z)};
  const Comparison result = compare(mesh, uniform_transform(1), uniform_transform(1));
  EXPECT_EQ(result.wrong, 0u);
  EXPECT_GT(result.on_surface, 100u);
}

TEST(VoxelizeCgal, HalfAVoxelIsSeen) { // negative control
  GridTransform shifted = uniform_transform(1);
  shifted.m[7] = 0.5;
  EXPECT_GT(compare(sphere_mesh(2, 12, {}), uniform_transform(1), shifted).wrong, 100u);
}

void compare_file(const std::string& name, std::int64_t dim) {
  const TriangleMesh mesh = load_test_mesh(name);
  if (mesh.triangles.empty())
    GTEST_SKIP() << "no " << name;
  const GridTransform lattice = lattice_for_dim(bounding_box(mesh), dim);
  const Comparison result = compare(mesh, lattice, lattice);
  EXPECT_GT(result.inside, 1000u);
  EXPECT_EQ(result.wrong, 0u);
}

TEST(VoxelizeCgal, Liver) {
  compare_file("sofa_liver_coarse.obj", 64);
}
TEST(VoxelizeCgal, Colon) {
  compare_file("gca90_large_intestine_20k.stl", 64);
}

} // namespace
