#pragma once
// Repair of triangle meshes by options, with counts.

#include "base/context.h"
#include "geometry/mesh.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::repair {

/// Repairs to do, in the order in which they are done. Nothing else is changed.
struct RepairOptions {
  /// Points nearer to each other than this, in mm, are merged into the first of them; 0:
  /// repair_weld_share of the box's longest side.
  std::optional<double> weld;
  bool duplicates = false;            ///< faces with the corners of an earlier one are removed
  bool orientation = false;           ///< faces are turned so that neighbours agree, and outward
  bool degenerate = false;            ///< faces without area are removed
  std::optional<std::uint64_t> holes; ///< largest number of edges of a hole that is filled
  /// Limit of the search for the filling of bent holes: those for which Delaunay tetrahedra contain
  /// no filling. The search takes as many steps as the third power of a hole's edges. All searches
  /// together may take the steps of one hole of so many edges, which is seconds.
  std::uint64_t searched_edges = 600;

  bool operator==(const RepairOptions&) const = default;
};

/// Largest displacement of points by rounding to single precision, or to seven digits; over the
/// box.
inline constexpr double repair_weld_share = 1e-6;
/// A face is without area if one of its edges is this many times as long as another, or its largest
/// angle is at least this, in degrees.
inline constexpr double repair_needle = 1e4, repair_cap = 179.99;

/// Parses words separated by commas: weld or weld:MM, duplicates, orientation, degenerate, holes or
/// holes:EDGES, and `all` for all five; "" is none. A number after a word overrides that of `all`.
/// \throw Error
RepairOptions parse_repair(std::string_view text);

struct RepairReport {
  std::uint64_t welded_points = 0;    ///< points merged into another one
  std::uint64_t collapsed_faces = 0;  ///< faces removed because two corners were merged
  std::uint64_t duplicate_faces = 0;  ///< removed
  std::uint64_t turned_faces = 0;     ///< faces whose orientation was reversed
  std::uint64_t degenerate_faces = 0; ///< faces without area that were removed
  std::uint64_t degenerate_left = 0;  ///< faces without area that could not be removed
  /// Neighbours checked to decide whether an edge may be collapsed. This is the cost: a few for
  /// each face whose edge is collapsed, independent of the number of faces at a point.
  std::uint64_t neighbours_asked = 0;
  std::uint64_t holes = 0, hole_points = 0, hole_faces = 0; ///< filled holes; new points, new faces
  std::uint64_t holes_left = 0; ///< larger than requested, or the border meets itself, another
                                ///< sheet, or is that of one face alone
  std::uint64_t holes_bent = 0; ///< of holes_left: the search would exceed its limit

  /// A count with its name; `text` is its meaning ("points were welded").
  struct Line {
    const char* key;
    std::uint64_t count;
    const char* text;
    bool trouble; ///< requested, but not possible
  };
  std::vector<Line> lines() const;
};

/// Repairs in place. Remaining points and faces keep their order; new ones come last; points that
/// no face uses any more are removed. New faces have the part and the material of a neighbour, and
/// texture coordinates from the faces round the hole. Normals are dropped if points or faces
/// change.
///
///   weld         first within a part, then across parts for points on open borders. Closed parts
///                that touch stay apart (see Weld::borders). Near points in a chain are merged.
///   duplicates   faces with the same three corners, in either direction
///   orientation  closed surfaces face outward, and inward if they are a cavity of their own part.
///                Open surfaces agree with most of their area. They are turned outward if their
///                volume decides this.
///   degenerate   short edges are collapsed, flat faces merged with the neighbour at their longest
///                edge (CGAL)
///   holes        borders of one loop are filled by triangles like those around (CGAL; Liepa,
///                Filling Holes in Meshes, 2003), within the limit of searched_edges
///
/// Edges of three faces or more stay as they are; degenerate and holes treat each sheet by itself.
/// \pre check_mesh(mesh) passes   \throw Error if the weld distance is below 1e-12 of the box;
/// Cancelled
RepairReport repair_mesh(TriangleMesh& mesh, const RepairOptions& options, const Context& context);

} // namespace gewebe::repair
