#pragma once
// Examination and repair of tetrahedral meshes from other programs.

#include "tetrahedra/tet_mesh.h"

#include <cstdint>

namespace gewebe::tetrahedra {

/// Number of faulty elements of a kind, and the first of them.
struct TetFinding {
  std::uint64_t count = 0;
  std::uint32_t first = 0;

  void add(std::uint32_t which) {
    if (count++ == 0 || which < first)
      first = which;
  }
};

/// A quadratic edge whose middle lies farther than this share of its length from the middle between
/// its ends is curved. (Coordinates in single precision are taken for straight.)
inline constexpr double curved_edge = 1e-4;

/// Tetrahedra with equal corners, and those that repeat an earlier one, take no part in what is
/// said about faces, edges and the boundary.
struct TetReport {
  std::uint64_t points = 0, tetrahedra = 0;
  // `first` is a tetrahedron
  TetFinding inverted;   ///< volume < 0, and not flat
  TetFinding flat;       ///< |volume| <= 1e-12 longest edge³, or equal corners
  TetFinding duplicates; ///< with the same four corners as an earlier one
  /// Faces in three tetrahedra or more; the first tetrahedron at one.
  TetFinding crowded_faces;
  /// Faces of two tetrahedra that lie on the same side of it, neither of them flat.
  TetFinding overlapping_faces;
  TetFinding split_edges;  ///< with other middles in one tetrahedron than in another
  TetFinding curved_edges; ///< whose middle lies off by more than curved_edge
  // `first` is a point
  TetFinding unused_points;
  TetFinding reused_middles;     ///< middles of several edges, or corners too
  TetFinding nonmanifold_points; ///< of the boundary: triangles that are no single fan round it
  /// Edges of the boundary in another number of its triangles than two; a point at one.
  TetFinding nonmanifold_edges;

  std::uint64_t boundary_triangles = 0;
  double volume = 0; ///< signed, of the corners, mm³

  /// Nothing that require_sound refuses.
  bool sound() const {
    return inverted.count == 0 && flat.count == 0 && duplicates.count == 0 &&
           crowded_faces.count == 0 && overlapping_faces.count == 0 && split_edges.count == 0 &&
           reused_middles.count == 0;
  }
  bool manifold_boundary() const {
    return nonmanifold_edges.count == 0 && nonmanifold_points.count == 0;
  }
};

/// Time grows with points and tetrahedra. \pre check_mesh(mesh) passes
TetReport examine_tetrahedra(const TetMesh& mesh);

/// \throw Error that names what the finite element method can't use, how many and the first: flat,
/// inverted, repeated tetrahedra; crowded and overlapping faces; middles that are not those of one
/// edge; no tetrahedra at all
void require_sound(const TetReport& report);

/// What was done.
struct TetRepair {
  std::uint64_t turned = 0;             ///< inverted ones, two corners and their middles swapped
  std::uint64_t dropped_flat = 0;       ///< by the measure of TetReport::flat
  std::uint64_t dropped_duplicates = 0; ///< the first of its corners stays
  std::uint64_t dropped_points = 0;     ///< unused, with those that only dropped ones used
};

/// What is to be mended.
struct TetRepairOptions {
  bool turn = true, flat = true, duplicates = true;
};

/// Turns, drops and renumbers. Tetrahedra and points keep their order. What is left may still not
/// be sound: overlapping faces and split edges stay. \pre check_mesh(mesh) passes
TetRepair repair_tetrahedra(TetMesh& mesh, const TetRepairOptions& options = {});

/// Removes the points that are neither corner nor middle; returns how many.
std::uint64_t drop_unused_points(TetMesh& mesh);

} // namespace gewebe::tetrahedra
