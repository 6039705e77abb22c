#pragma once
// The triangle mesh that the stages exchange.

#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gewebe {

using Triangle = std::array<std::uint32_t, 3>;
using Tetrahedron = std::array<std::uint32_t, 4>;
/// Nodes in the middles of a tetrahedron's edges 01, 12, 02, 03, 13, 23 (VTK's order).
using EdgeMiddles = std::array<std::uint32_t, 6>;

/// A triangle mesh. Faces are counter-clockwise seen from outside (the side of lower density).
/// An optional array is either empty or has the size given here.
struct TriangleMesh {
  std::vector<Vec3> points;                    ///< millimetres
  std::vector<Triangle> triangles;             ///< corner indices into `points`
  std::vector<std::array<float, 3>> normals;   ///< optional, one per point, unit length
  std::vector<std::array<float, 6>> texcoords; ///< optional, per triangle s0 t0 s1 t1 s2 t2
  std::vector<std::int32_t> part;              ///< optional, per triangle, 0-based
  std::vector<std::int32_t> material;          ///< optional, per triangle, 0-based
};

/// Box of all points of the mesh, used by a triangle or not.
Box3 bounding_box(const TriangleMesh& mesh);

/// Signed volume in mm³ by the divergence theorem: positive for a closed mesh oriented outward.
double signed_volume(const TriangleMesh& mesh);

/// Sum of the triangles' areas in mm².
double surface_area(const TriangleMesh& mesh);

/// \throw Error if an index is out of range, a coordinate is not finite or an optional array has
/// the wrong size; the message names the first offender.
void check_mesh(const TriangleMesh& mesh);

} // namespace gewebe
