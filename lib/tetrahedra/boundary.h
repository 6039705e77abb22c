#pragma once
// The surface of a tetrahedral mesh.

#include "geometry/mesh.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gewebe::tetrahedra {

/// The faces of exactly one tetrahedron.
struct TetBoundary {
  /// Counter-clockwise seen from outside, also of inverted tetrahedra; by tetrahedron, then by the
  /// corner that the face lies opposite to. Points are those that a triangle uses, in their order
  /// in the tetrahedral mesh. `material` is that of the tetrahedra, if they have one.
  TriangleMesh mesh;
  std::vector<std::uint32_t> node;        ///< of each point: its number in the tetrahedral mesh
  std::vector<std::uint32_t> tetrahedron; ///< of each triangle
  /// Of each triangle of a quadratic mesh, else none: nodes, in the tetrahedral mesh, in the middle
  /// of the triangle's edges 01, 12, 20.
  std::vector<std::array<std::uint32_t, 3>> middles;
};

/// Tetrahedra with equal corners have no faces. Time grows with points and tetrahedra.
/// \pre check_mesh(mesh) passes   \throw Error if there are 2^30 tetrahedra or more
TetBoundary boundary(const TetMesh& mesh);

} // namespace gewebe::tetrahedra
