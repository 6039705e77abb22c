// Every voxel of every closed organ at 128³ and 256³, and of cubes of all sizes from 1 to 64 at all
// eighths of a voxel, against CGAL's exact point-in-mesh test. Argument: the largest size (default
// 256).

#include "tests/unit/cgal_side.h"
#include "volume/lattice.h"

#include <cstdio>
#include <cstdlib>

namespace {

using namespace gewebe;
using namespace gewebe::test;

/// Returns whether no voxel is wrong and no ray odd.
bool check(const char* name, const TriangleMesh& mesh, const volume::GridTransform& lattice) {
  const CgalSide side(mesh, lattice);
  voxelization::VoxelizeReport report;
  const voxelization::InsideScan scan =
      voxelization::scan_inside(Context{}, mesh, lattice, {}, &report);
  Int3 min{}, max{};
  if (!volume::index_range(lattice, bounding_box(mesh), min, max))
    return false;
  for (std::size_t a = 0; a < 3; ++a) {
    --min[a];
    ++max[a];
  }
  const SideCount count = compare_box(side, scan, min, max);
  const bool right = count.wrong == 0 && report.odd_rays == 0 && count.inside > 0 &&
                     side.faces() == mesh.triangles.size();
  if (name != nullptr || !right)
    std::printf("%s: %zu inside, %zu on the surface, %zu wrong, %zu odd rays, faces %zu of %zu\n",
                name != nullptr ? name : "cube", count.inside, count.on_surface, count.wrong,
                static_cast<std::size_t>(report.odd_rays), side.faces(), mesh.triangles.size());
  return right;
}

} // namespace

int main(int argc, char** argv) {
  const int largest = argc > 1 ? std::atoi(argv[1]) : 256;
  bool right = true;
  for (int size = 1; size <= 64; ++size)
    for (int eighth = 0; eighth < 8; ++eighth) {
      const Vec3 low{eighth / 8.0, -3 + eighth / 4.0, -5 - eighth / 8.0};
      // CGAL is slow where cubes are large and says nothing new: their size decides
      if (size <= 16 || size % 16 == eighth)
        right &= check(nullptr, box_mesh(low, low + Vec3{1.0 * size, 1.0 * size, 1.0 * size}),
                       volume::uniform_transform(1));
    }
  right &= check("bottle", thin_bottle(), volume::uniform_transform(1));
  for (const char* name : {"sofa_liver_coarse.obj", "sofa_liver_smooth.obj",
                           "gca90_large_intestine_20k.stl", "hubmap_F_spleen_uv.obj"}) {
    const TriangleMesh mesh = load_test_mesh(name);
    if (mesh.triangles.empty()) {
      std::printf("%s: skipped, no such file\n", name);
      continue;
    }
    for (int dim = 128; dim <= largest; dim *= 2)
      right &= check(name, mesh, volume::lattice_for_dim(bounding_box(mesh), dim));
  }
  return right ? 0 : 1;
}
