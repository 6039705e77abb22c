#pragma once
// Repair of triangle meshes by options, with counts.

#include "base/context.h"
#include "base/mesh.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe {

/// What is to be repaired, in the order in which it is done. Nothing else is changed.
struct RepairOptions {
  /// Points nearer than this become the first of them, mm; 0: repair_weld_share of the box's
  /// longest side.
  std::optional<double> weld;
  bool duplicates = false;            ///< faces with the corners of an earlier one go
  bool orientation = false;           ///< faces are turned so that neighbours agree, and outward
  bool degenerate = false;            ///< faces without area go
  std::optional<std::uint64_t> holes; ///< of at most so many edges are filled
  /// Holes that are so bent that Delaunay's tetrahedra hold no filling are filled by a search of as
  /// many steps as the third power of their edges, all together by those of one hole of so many
  /// edges: seconds.
  std::uint64_t searched_edges = 600;

  bool operator==(const RepairOptions&) const = default;
};

/// What rounding to single precision, or to seven digits, moves points by; over the box.
inline constexpr double repair_weld_share = 1e-6;
/// A face is without area if one of its edges is this many times as long as another, or its largest
/// angle is at least this, in degrees.
inline constexpr double repair_needle = 1e4, repair_cap = 179.99;

/// Understands words with commas: weld or weld:MM, duplicates, orientation, degenerate, holes or
/// holes:EDGES, and all for the five of them; "" is none. A number after a word overrides that of
/// `all`. \throw Error
RepairOptions parse_repair(std::string_view text);

struct RepairReport {
  std::uint64_t welded_points = 0;    ///< joined to another one
  std::uint64_t collapsed_faces = 0;  ///< two of whose corners were so joined: gone
  std::uint64_t duplicate_faces = 0;  ///< gone
  std::uint64_t turned_faces = 0;     ///< whose corners run the other way now
  std::uint64_t degenerate_faces = 0; ///< without area before and not after
  std::uint64_t degenerate_left = 0;  ///< which could not be removed
  /// Neighbours checked to decide if the ends of an edge may become one point: the cost, a few for
  /// each face whose edge goes, however many faces meet in a point.
  std::uint64_t neighbours_asked = 0;
  std::uint64_t holes = 0, hole_points = 0, hole_faces = 0; ///< filled, new, new
  std::uint64_t holes_left = 0; ///< larger than requested, or the border meets itself, another
                                ///< sheet, or is that of one face alone
  std::uint64_t holes_bent = 0; ///< of those left: the search would take more than it may

  /// Each count under its name; `text` says what it means ("points were welded").
  struct Line {
    const char* key;
    std::uint64_t count;
    const char* text;
    bool trouble; ///< requested, but not possible
  };
  std::vector<Line> lines() const;
};

/// Repairs in place. Points and faces that stay keep their order; new ones come last; points that
/// no face uses any more go. New faces have the part and the material of a neighbour, and texture
/// coordinates from the faces round the hole. Normals are dropped where points or faces change.
///
///   weld         within a part, then across parts where points lie on open borders, so that closed
///                parts that touch stay apart (see Weld::borders); chains of near points become one
///   duplicates   the same three corners, run in either direction
///   orientation  closed surfaces face outward, and inward where they are a cavity of their own
///                part; open ones agree with most of their area, and are turned outward where their
///                volume tells
///   degenerate   short edges are collapsed, flat faces merged with the neighbour at their longest
///                edge (CGAL)
///   holes        borders of one loop are filled by triangles like those around (CGAL; Liepa,
///                Filling Holes in Meshes, 2003), except for searched_edges
///
/// Edges of three faces or more stay as they are; degenerate and holes work on each sheet alone.
/// \pre check_mesh(mesh) passes   \throw Error if the weld distance is below 1e-12 of the box;
/// Cancelled
RepairReport repair_mesh(TriangleMesh& mesh, const RepairOptions& options, const Context& context);

} // namespace gewebe
