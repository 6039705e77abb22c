#pragma once
// Cuts of tetrahedral solids along a surface swept by a blade, with walls of the wound.
//
// If the blade passes through an edge, a node is put into the edge, or a node close by is used, as
// in isosurface stuffing (Labelle and Shewchuk 2007). The close node is moved onto the blade if
// that is allowed and harms no shape. Tetrahedra with such edges are halved edge by edge, in one
// order of all edges, so that neighbours agree on their common faces. Faces between tetrahedra
// above and below the blade are the wall. They divide the tetrahedra round each node into pieces,
// and each piece gets a node of its own (the virtual nodes of Molino, Bao and Fedkiw 2004, without
// their overlap).

#include "geometry/mesh.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::incision {

/// Degrees. Dihedral angles of tetrahedra that a cut has changed lie between this and 180 minus
/// this, or those of the tetrahedron before do not either, and are no worse.
inline constexpr double blade_cut_least_angle = 8;

/// Share of an edge's length. If the blade passes nearer to a node than this, the node is moved
/// onto the blade, if possible.
inline constexpr double blade_cut_snap = 0.3;

struct BladeCutOptions {
  double snap = blade_cut_snap;               ///< 0 … 0.5
  double least_angle = blade_cut_least_angle; ///< 0 to below 60
  /// Positions of the nodes at the time of the cut, one per node; empty: at rest. The blade's
  /// points are in the same frame. Shapes, volumes and the result are those at rest.
  std::span<const Vec3> places = {};
  /// Nodes that must not be moved (they are doubled like others), in any order.
  std::span<const std::uint32_t> held = {};
  /// By node 0 or 1, of quadratic meshes by corner at least: the blade passes edges between such
  /// ones alone; empty: all.
  std::span<const std::uint8_t> among = {};
  /// The wound follows the faces of the mesh: no node is moved, none is put into an edge.
  bool along_faces = false;
};

/// Former position of a node of the cut mesh.
struct TetNodeOrigin {
  static constexpr std::uint32_t none = UINT32_MAX;

  std::uint32_t node = none;        ///< at this node, or
  std::uint32_t tetrahedron = none; ///< in this tetrahedron
  std::array<double, 4> weights{};  ///< of its corners, sum 1; middles of edges can lie beside it

  bool operator==(const TetNodeOrigin&) const = default;
};

/// Pair of coincident triangles, one on each side of the wound. `corners[s]` are counter-clockwise
/// seen from outside of `tetrahedron[s]`. Side 0 lies above the blade (where its triangles appear
/// counter-clockwise), side 1 below. Corner k of side 0 and corner 2 - k of side 1 have the same
/// position. (For an opened face, which is off the blade, either side may be side 0.)
struct WallTriangle {
  std::array<Triangle, 2> corners{};
  std::array<Triangle, 2> middles{}; ///< of edges 01, 12, 20, where the mesh is quadratic
  std::array<std::uint32_t, 2> tetrahedron{};
};

/// A face of the boundary, beside the wall, or a part of one.
struct CutFace {
  Triangle corners{};            ///< counter-clockwise seen from outside
  Triangle middles{};            ///< of edges 01, 12, 20, where the mesh is quadratic
  std::uint32_t tetrahedron = 0; ///< whose face it is now
  std::uint32_t face_before = 0; ///< 4 tetrahedron + k of the face that it lay in
  /// Of each corner: where it stood in the corners of that face (tetrahedron_faces), sum 1; beside
  /// it, if the node has moved.
  std::array<std::array<double, 3>, 3> weights{};
};

struct BladeCutReport {
  std::uint64_t tested = 0;    ///< edges compared with the blade
  std::uint64_t separated = 0; ///< tetrahedra that the blade passes through from side to side
  std::uint64_t split = 0;     ///< tetrahedra that have become several
  std::uint64_t moved = 0;     ///< nodes moved onto the blade
  std::uint64_t kept = 0;      ///< nodes that the wall passes through though the blade misses them
  double largest_miss = 0;     ///< of these, along an edge at rest, mm
  std::uint64_t doubled = 0;   ///< copies of nodes
  std::uint64_t folded = 0;    ///< edges that the blade passes more than once: at most one is seen
  std::uint64_t opened = 0;    ///< faces between the wall and an earlier wound that touched it
  std::uint64_t rejoined = 0;  ///< faces that would have left tissue hanging by a node or an edge
};

/// Result of a cut. Former nodes and tetrahedra keep their numbers; the first part of a split
/// tetrahedron keeps its number. New nodes come after the former ones: nodes in edges, by the ends
/// of the edges, then copies, by their nodes. Other parts of tetrahedra follow by tetrahedron.
struct TetCut {
  tetrahedra::TetMesh mesh;
  std::vector<TetNodeOrigin> origin;      ///< by node
  std::vector<std::uint32_t> tetrahedron; ///< by tetrahedron: the former one that it is (a part of)
  std::vector<WallTriangle> wall;
  /// Boundary near the blade. It replaces the faces named by face_before; other faces stay. By
  /// former tetrahedron.
  std::vector<CutFace> surface;
  /// Former tetrahedra that were split, or have a corner that was moved or renamed; ascending.
  std::vector<std::uint32_t> changed;
  BladeCutReport report;
};

/// Cuts along the triangles of `blade`, a surface of one sheet which may end anywhere and need not
/// be flat: a quadrilateral between two places of an edge as two triangles, several in a row
/// sharing their points.
///
/// A tetrahedron is cut if the blade passes through its edges so that its corners fall into two
/// sets. Signs are those of exact predicates; a corner exactly on the blade counts as on the side
/// to which a step along x, else y, else z leads. A tetrahedron in which the blade ends is not cut,
/// so that the wound ends at most an element before the blade does; nodes there are not doubled. To
/// cut step by step, pass each step together with the earlier ones back to the wound's end: nodes
/// that are on the blade already are found again. A second leaf of the blade within one edge is
/// ignored (`folded`): pass leaves that are so close in separate calls.
///
/// The volume of each material stays, to rounding: a node on the boundary, or between materials, is
/// moved only within all planes of such faces at it. If no way to cut a tetrahedron keeps the least
/// angle, the wall passes through the nearest node instead. That node may miss the blade by up to
/// half an edge (`kept`, `largest_miss`). At worst the wound follows the faces of the mesh.
///
/// If the boundary round a node was one fan of triangles, it still is. If the front of an earlier
/// wound touches the wall, faces between them are opened (`opened`; they belong to the wall, though
/// they are not on the blade). Elsewhere, faces of the wall that would leave tissue connected by
/// one node or one edge only are joined again (`rejoined`).
///
/// Time is linear in the points and tetrahedra of the mesh with a small factor (tests of boxes),
/// plus work in proportion to the tetrahedra at nodes of edges that the blade passes. It uses one
/// thread.
/// \pre check_mesh(mesh) passes
/// \throw Error if an edge near the blade is curved (curved_edge); if a tetrahedron near the blade
/// has no positive volume; if a point of the blade or a place is not finite or too far away (2^40
/// mm); if the blade has an edge with three triangles, or two that run along it the same way; if an
/// option is out of its range; if there are too many nodes or tetrahedra
TetCut cut_tetrahedra(const tetrahedra::TetMesh& mesh, const TriangleMesh& blade,
                      const BladeCutOptions& options = {});

/// Former nodes that determine the value at a new node by the shape functions of the element, with
/// their shares, sum 1. No share is 0.
std::vector<std::pair<std::uint32_t, double>> shares_of(const tetrahedra::TetMesh& before,
                                                        const TetNodeOrigin& origin);

/// Interpolates a field from the former nodes to those of the cut mesh, by the shape functions of
/// the former elements. \pre `field` has one value per former node
std::vector<Vec3> carry_over(const tetrahedra::TetMesh& before,
                             std::span<const TetNodeOrigin> origin, std::span<const Vec3> field);

} // namespace gewebe::incision
