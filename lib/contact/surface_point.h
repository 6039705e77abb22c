#pragma once
// Where a piece of surface, flat between up to three nodes, is nearest to an instrument.
//
// An instrument is all points within its radius of its core: a point, a segment, or a polyhedron.
// It is outside of a piece exactly if each distance between one of these pairs is at least the
// radius, of a point or a segment:
//
//   an end of the core, and the whole piece;
//   the core between its ends, and a corner;
//   the core between its ends, and an edge between its corners, where they cross.
//
// Each of them changes smoothly with the corners' places x_i while it isn't 0: by w_i n, with the
// weights w of the piece's nearest point and the unit normal n from the core to it. (The second
// kinds turn into the first as their nearest points leave the core at its end, with the same w and
// n.) Where nearest points are on an edge or a corner, all pieces that share it have the same.
//
// Of a polyhedron:
//
//   a corner of the core, and the piece's midst or its edges between their ends;
//   the whole core, and a corner of the piece: below 0 inside, by the nearest face;
//   an edge of the core, and one of the piece, where they cross.
//
// The distance from the whole core is smooth outside of it, and the core's faces need no pairs of
// their own: where one of them is nearest to a piece, a corner of that is as near.

#include "base/vec3.h"
#include "contact/instrument.h"

#include <array>
#include <compare>
#include <cstdint>
#include <optional>

namespace gewebe {

/// A piece of surface by its corners; a piece with fewer repeats the last one.
using Facet = std::array<std::uint32_t, 3>;

inline int corner_count(const Facet& f) {
  return f[0] == f[1] ? 1 : f[1] == f[2] ? 2 : 3;
}

/// Which part of the core a distance is taken from. A segment has two corners and an edge.
struct CorePart {
  enum class Kind : std::uint8_t { corner, edge, whole };
  Kind kind = Kind::corner;
  std::uint32_t number = 0;

  auto operator<=>(const CorePart&) const = default;
  static const CorePart first_end, second_end, between, whole;
};
inline constexpr CorePart CorePart::first_end{Kind::corner, 0};
inline constexpr CorePart CorePart::second_end{Kind::corner, 1};
inline constexpr CorePart CorePart::between{Kind::edge, 0};
inline constexpr CorePart CorePart::whole{Kind::whole, 0};

struct SurfacePoint {
  std::array<double, 3> weights{}; ///< >= 0, of the corners, with sum 1; exactly 0 on an edge
  Vec3 place;                      ///< of the piece's nearest point
  Vec3 core;                       ///< of the core's
  double distance = 0;             ///< between both; below 0 inside of a whole core
  Vec3 out;                        ///< of a whole core: the normal, whatever the distance; else 0
  /// From a polyhedron's corner or edge the piece is through its inside: such a pair must be no new
  /// one, for it would push the piece in.
  bool behind = false;

  bool has_normal(double least) const { return out != Vec3{} || distance > least; }
  /// From the core to the piece; where both are one point, `other`.
  Vec3 normal(const Vec3& other) const {
    return out != Vec3{} ? out : distance > 0 ? (place - core) / distance : other;
  }
};

/// Nearest points of a part of the core and a piece of `count` corners: of a whole one for a corner
/// of the core, of a corner (count 1) or an edge (2) else. None where they are not between the ends
/// of both edges, and none of a polyhedron's corner at one of the piece's. \pre corners has
/// `count` elements that count; for_parts calls for such a pair
std::optional<SurfacePoint> nearest_points(const PlacedInstrument& instrument, CorePart part,
                                           const std::array<Vec3, 3>& corners, int count);

/// Whether the core goes through the middle of a whole piece, which no distance of a part tells:
/// its ends may both be far. Of a polyhedron, whether the piece comes into it.
bool goes_through(const PlacedInstrument& instrument, const std::array<Vec3, 3>& corners);

} // namespace gewebe
