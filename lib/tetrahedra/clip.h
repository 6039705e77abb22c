#pragma once
// A solid cut open by a plane: what is left of its boundary, and the faces of the cut.

#include "geometry/mesh.h"
#include "geometry/vec3.h"
#include "tetrahedra/tet_mesh.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::tetrahedra {

/// What lies on the side of the normal is taken away: (p - point) · normal > 0.
struct ClipPlane {
  Vec3 point;  ///< mm
  Vec3 normal; ///< of any length but 0
};

/// Where a point of what is left stands: a + share (b - a) between two nodes; of a node both are
/// it.
struct ClipPoint {
  std::uint32_t a = 0, b = 0;
  double share = 0;
};

/// The boundary of what is left.
struct TetClip {
  /// Triangles of the mesh's boundary that stay, and the parts of those that the plane cuts, by
  /// tetrahedron; then those of the cut, by tetrahedron. All face outward. Points are nodes, in
  /// their order, then crossings of the plane with edges, by the numbers of their ends, each once:
  /// where the boundary of the mesh is closed this is closed too. `material` is that of the
  /// tetrahedra, if they have one.
  TriangleMesh mesh;
  std::vector<ClipPoint> origin;          ///< of each point
  std::vector<std::uint32_t> tetrahedron; ///< of each triangle: whose face or section it is
  std::size_t cut_begin = 0;              ///< the first triangle of the cut
  std::uint64_t tetrahedra_cut = 0;       ///< with nodes on both sides
  std::uint64_t tetrahedra_removed = 0;   ///< without a node on the side that stays
};

/// Each tetrahedron with nodes on both sides gives a convex polygon of 3 or 4 corners (marching
/// tetrahedra: Doi and Koide 1991); a face that lies in the plane between one that stays and one
/// that goes is of the cut, too. A node lies in the plane if the rounding of its coordinates and of
/// the plane's point leaves its side open (4 units in their last place); crossings are interpolated
/// from the nearer end of their edge. Quadratic ones are taken by their corners
/// (linear_parts() in tetrahedra/order.h are nearer). Turned ones (as displacements may leave) are
/// cut like others. A plane that takes
/// nothing away gives boundary(mesh), one that takes all a mesh without points.
/// \pre check_mesh(mesh) passes, require_sound(examine_tetrahedra(mesh)) too, or would at other
/// places of its points
/// \throw Error if the normal is 0, the plane or a distance from it is not finite, or there are too
/// many points
TetClip clip_tetrahedra(const TetMesh& mesh, const ClipPlane& plane);

} // namespace gewebe::tetrahedra
