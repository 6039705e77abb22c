#pragma once
// Clean-up of a mesh for a net of springs: used faces and points with new numbers.

#include "base/context.h"
#include "geometry/mesh.h"
#include "mesh/edges.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::model {

/// The triangles that are used, with corners renumbered to the points that are used.
struct UsableSurface {
  std::vector<std::uint32_t> point_of_node; ///< ascending
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> face_of_triangle; ///< in the mesh, ascending
  mesh::EdgeTable edges;
  std::size_t degenerate_faces = 0; ///< with equal corners: left out
  std::size_t duplicate_faces = 0;  ///< with the corners of an earlier one: left out
  std::size_t isolated_points = 0;  ///< of no other face: left out
};

/// \pre corners are below the number of points   \throw Error if no triangle is left; as edge_table
UsableSurface usable_surface(const TriangleMesh& mesh, const Context& context);

} // namespace gewebe::model
