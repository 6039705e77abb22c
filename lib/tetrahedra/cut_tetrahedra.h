#pragma once
// Tetrahedral solids cut along a surface that a blade has swept, so that the wound has walls.
//
// Where the blade passes through an edge a node is put into it, or a node close by is taken instead
// (and moved onto the blade, where that is allowed and harms no shape), as isosurface stuffing does
// (Labelle and Shewchuk 2007). Tetrahedra with such edges are halved edge by edge, in one order of
// all edges, so that neighbours agree on the faces that they share. Faces between what lies above
// the blade and what lies below are the wall; along them the tetrahedra round each node fall into
// pieces, and each piece gets a node of its own (the virtual nodes of Molino, Bao and Fedkiw 2004,
// without their overlap).

#include "base/mesh.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe {

/// Degrees. Dihedral angles of tetrahedra that a cut has changed lie between this and 180 minus
/// this, or those of the tetrahedron before do not either, and are no worse.
inline constexpr double blade_cut_least_angle = 8;

/// Of an edge's length: where the blade passes nearer to a node than this, the node is moved onto
/// it, if it can be.
inline constexpr double blade_cut_snap = 0.3;

struct BladeCutOptions {
  double snap = blade_cut_snap;               ///< 0 … 0.5
  double least_angle = blade_cut_least_angle; ///< 0 to below 60
  /// Where the nodes are when the blade comes, if not at rest: empty, or one place per node. The
  /// blade's points lie there; shapes, volumes and the result are those at rest.
  std::span<const Vec3> places = {};
  /// Nodes that must not be moved (they are doubled like others), in any order.
  std::span<const std::uint32_t> held = {};
  /// By node 0 or 1, of quadratic meshes by corner at least: the blade passes edges between such
  /// ones alone; empty: all.
  std::span<const std::uint8_t> among = {};
  /// The wound follows the faces of the mesh: no node is moved, none is put into an edge.
  bool along_faces = false;
};

/// Where a node of the cut mesh stood before.
struct TetNodeOrigin {
  static constexpr std::uint32_t none = UINT32_MAX;

  std::uint32_t node = none;        ///< at this node, or
  std::uint32_t tetrahedron = none; ///< in this tetrahedron
  std::array<double, 4> weights{};  ///< of its corners, sum 1; middles of edges can lie beside it

  bool operator==(const TetNodeOrigin&) const = default;
};

/// Both sides of the wound at one place: triangles of the same shape, which look into the wound
/// from either tissue. `corners[s]` are counter-clockwise seen from outside of `tetrahedron[s]`;
/// side 0 lies above the blade (where its triangles appear counter-clockwise), side 1 below.
/// Corner k of side 0 and corner 2 - k of side 1 stand at one place. (Of an opened face, which is
/// off the blade, either side is 0.)
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

/// Nodes and tetrahedra before keep their numbers; of a split tetrahedron the first part does.
/// Behind them stand nodes in edges, by the ends of these, then copies, by their nodes; other
/// parts, by the tetrahedron.
struct TetCut {
  TetMesh mesh;
  std::vector<TetNodeOrigin> origin;      ///< of each node
  std::vector<std::uint32_t> tetrahedron; ///< of each: that before which it is (a part of)
  std::vector<WallTriangle> wall;
  /// The boundary near the blade: takes the place of the faces that it
  /// names; other faces stay. By tetrahedron before.
  std::vector<CutFace> surface;
  /// Tetrahedra before of which a corner has been moved or renamed, or which were split; ascending.
  std::vector<std::uint32_t> changed;
  BladeCutReport report;
};

/// Cuts along the triangles of `blade`, a surface of one sheet which may end anywhere and need not
/// be flat: a quadrilateral between two places of an edge as two triangles, several in a row
/// sharing their points.
///
/// A tetrahedron is cut where the blade passes through edges so that its corners fall into two sets
/// (signs by exact predicates; one exactly on the blade counts as on the side to which a step along
/// x, else y, else z leads). One in which the blade ends is not cut, so that the wound ends at most
/// an element before the blade does; nodes there are not doubled. Who cuts step by step passes each
/// step with those before it back to the wound's end: nodes that stand on the blade already are
/// found again. A second leaf of the blade within one edge is not seen (`folded`): pass leaves that
/// close one after the other.
///
/// The volume of each material stays, to rounding: a node on the boundary, or between materials, is
/// moved only within all planes of such faces at it. Where no way to cut a tetrahedron keeps the
/// least angle, the wall passes through the nearest node instead, which may miss the blade by up to
/// half an edge (`kept`, `largest_miss`); at worst the wound follows the faces of the mesh.
///
/// Round each node the boundary is one fan of triangles afterwards if it was before: where the
/// front of an earlier wound touches the wall, faces in between are opened (`opened`; they are of
/// the wall, though not on the blade); elsewhere faces of the wall that would leave tissue hanging
/// together by one node or one edge are joined again (`rejoined`).
///
/// Linear in the points and tetrahedra of the mesh with a small factor (boxes against those of the
/// blade); everything beyond that is in proportion to the tetrahedra at nodes of edges that the
/// blade passes. On one thread.
/// \pre check_mesh(mesh) passes
/// \throw Error if an edge near the blade is curved (curved_edge); if a tetrahedron near the blade
/// has no positive volume; if a point of the blade or a place is not finite or too far away (2^40
/// mm); if the blade has an edge with three triangles, or two that run along it the same way; if an
/// option is out of its range; if there are too many nodes or tetrahedra
TetCut cut_tetrahedra(const TetMesh& mesh, const TriangleMesh& blade,
                      const BladeCutOptions& options = {});

/// The nodes before whose values make the value there, by the shape functions of the element, with
/// their shares, sum 1. None of them has a share of 0.
std::vector<std::pair<std::uint32_t, double>> shares_of(const TetMesh& before,
                                                        const TetNodeOrigin& origin);

/// What has a value at each node before, at those of the cut mesh: by the shape functions of the
/// elements before. \pre `field` has one value per node before
std::vector<Vec3> carry_over(const TetMesh& before, std::span<const TetNodeOrigin> origin,
                             std::span<const Vec3> field);

} // namespace gewebe
