#pragma once
// Where a piece of surface, flat between up to three nodes, is nearest to an instrument.
//
// An instrument is all points within its radius of its core, a point or a segment. It is outside of
// a piece exactly if each distance between one of these pairs is at least the radius:
//
//   an end of the core, and the whole piece;
//   the core between its ends, and a corner;
//   the core between its ends, and an edge between its corners, where they cross.
//
// Each of them changes smoothly with the corners' places x_i while it isn't 0: by w_i n, with the
// weights w of the piece's nearest point and the unit normal n from the core to it. (The second
// kinds turn into the first as their nearest points leave the core at its end, with the same w and
// n.) Where nearest points are on an edge or a corner, all pieces that share it have the same.

#include "base/vec3.h"
#include "contact/instrument.h"

#include <array>
#include <cstdint>
#include <optional>

namespace gewebe {

/// A piece of surface by its corners; a piece with fewer repeats the last one.
using Facet = std::array<std::uint32_t, 3>;

inline int corner_count(const Facet& f) {
  return f[0] == f[1] ? 1 : f[1] == f[2] ? 2 : 3;
}

/// Which part of the core a distance is taken from.
enum class CorePart : std::uint8_t { first_end, second_end, between };

struct SurfacePoint {
  std::array<double, 3> weights{}; ///< >= 0, of the corners, with sum 1; exactly 0 on an edge
  Vec3 place;                      ///< of the piece's nearest point
  Vec3 core;                       ///< of the core's
  double distance = 0;             ///< between both

  /// From the core to the piece; where both are one point, `other`.
  Vec3 normal(const Vec3& other) const { return distance > 0 ? (place - core) / distance : other; }
};

/// Nearest points of a part of the core and a piece of `count` corners: of a whole one for an end,
/// of a corner (count 1) or an edge (2) else. None where they are not between the core's ends and
/// between the edge's. \pre corners has `count` elements that count; between: count <= 2
std::optional<SurfacePoint> nearest_points(const PlacedInstrument& instrument, CorePart part,
                                           const std::array<Vec3, 3>& corners, int count);

/// Whether the core goes through the middle of a whole piece, which no distance of a part tells:
/// its ends may both be far.
bool goes_through(const PlacedInstrument& instrument, const std::array<Vec3, 3>& corners);

} // namespace gewebe
