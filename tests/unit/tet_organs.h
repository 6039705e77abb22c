#pragma once
// Organs of the shared data as tetrahedra.

#include "mesh_fixtures.h"
#include "stuffing/stuffing.h"
#include "voxelization/voxelize.h"

#include <string>

namespace gewebe::test {

/// What is in a closed surface, its longest side so many cells.
inline tetrahedra::TetMesh surface_tetrahedra(const TriangleMesh& surface, double cells) {
  const double cell = bounding_box(surface).longest_side() / cells;
  voxelization::VoxelizeOptions exact;
  exact.samples = 3;
  exact.rule = voxelization::VoxelRule::winding;
  const volume::Grid grid =
      voxelization::voxelize({}, surface, volume::uniform_transform(cell / 2), exact);
  stuffing::StuffingOptions options;
  options.cell = cell;
  return stuffing::stuff({}, grid, options);
}

/// As that; empty where there is no such file.
inline tetrahedra::TetMesh organ_tetrahedra(const std::string& file, double cells) {
  const TriangleMesh surface = load_test_mesh(file);
  return surface.triangles.empty() ? tetrahedra::TetMesh{} : surface_tetrahedra(surface, cells);
}

} // namespace gewebe::test
