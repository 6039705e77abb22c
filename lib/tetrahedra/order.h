#pragma once
// The order of nodes, and quadratic elements.

#include "tetrahedra/tet_mesh.h"

#include <cstdint>
#include <vector>

namespace gewebe::tetrahedra {

/// How nodes are numbered: groups one after the other, each in its old order.
struct NodeOrder {
  std::uint32_t surface_corners = 0; ///< corners of boundary triangles
  std::uint32_t surface_middles = 0; ///< middles of their edges
  std::uint32_t inner_corners = 0;   ///< other corners of tetrahedra
  std::uint32_t inner_middles = 0;   ///< middles of other edges
  std::uint32_t unused = 0;
  std::vector<std::uint32_t> number; ///< of each old node: its new number

  std::uint32_t surface() const { return surface_corners + surface_middles; }
};

/// Renumbers the nodes: those of the boundary first (corners, then middles of edges), then inner
/// corners, then inner middles, then nodes that nothing uses. Tetrahedra keep their order and that
/// of their corners. \pre check_mesh(mesh) passes
NodeOrder order_nodes(TetMesh& mesh);

/// Adds a node in the middle of each edge, shared by the tetrahedra at it, after the other points:
/// by the first tetrahedron at the edge, then its place in EdgeMiddles. \pre check_mesh(mesh)
/// passes, no tetrahedron has equal corners \throw Error if it is quadratic already, has equal
/// corners, or too many nodes
void make_quadratic(TetMesh& mesh);

/// Linear tetrahedra on the nodes of a quadratic mesh: each becomes eight, one at each corner and
/// four about the line between the middles of edges 02 and 13, so that each face becomes four
/// triangles as a model's surface has them. A linear mesh stays as it is.
/// \pre check_mesh(mesh) passes
TetMesh linear_parts(TetMesh mesh);

} // namespace gewebe::tetrahedra
