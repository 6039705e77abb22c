#pragma once
// Tetrahedral mesh, the data exchanged between stages.

#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gewebe::tetrahedra {

/// A tetrahedral mesh. Functions that require a checked mesh need positive volumes, (b - a) × (c -
/// a) · (d - a) > 0. An optional array is either empty or has the size given here.
struct TetMesh {
  std::vector<Vec3> points;            ///< millimetres
  std::vector<Tetrahedron> tetrahedra; ///< corner indices into `points`
  std::vector<EdgeMiddles> middles;    ///< optional, per tetrahedron: quadratic elements
  std::vector<std::int32_t> material;  ///< optional, per tetrahedron, 0 and up
};

/// The faces of a tetrahedron of positive volume, counter-clockwise seen from outside; face k lies
/// opposite to corner k.
inline constexpr std::array<std::array<std::uint8_t, 3>, 4> tetrahedron_faces{
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

/// The ends of its edges in the order of EdgeMiddles.
inline constexpr std::array<std::array<std::uint8_t, 2>, 6> tetrahedron_edges{
    {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};

inline double tetrahedron_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return dot(cross(b - a, c - a), d - a) / 6;
}

/// Box of all points of the mesh, used by a tetrahedron or not.
Box3 bounding_box(const TetMesh& mesh);

/// Sum of the volumes of the tetrahedra by their corners, mm³.
double volume(const TetMesh& mesh);

/// \throw Error if an index is out of range, a coordinate is not finite or an optional array has
/// the wrong size; the message names the first offender.
void check_mesh(const TetMesh& mesh);

} // namespace gewebe::tetrahedra
