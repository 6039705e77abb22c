#pragma once
// Lattice points beside the surface: where it cuts their edges, and which of them are moved onto
// it. For the room alone.

#include "base/context.h"
#include "stuffing/bcc_internal.h"
#include "stuffing/lattice_internal.h"
#include "volume/grid.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace gewebe::stuffing {

/// A lattice point with an edge to the other side.
struct BoundaryLatticePoint {
  static constexpr std::uint8_t stays = 0xff;
  static constexpr std::uint32_t none = UINT32_MAX;

  std::uint32_t block = 0;
  std::uint16_t word = 0, bit = 0;
  bool inside = false;
  /// Where no tetrahedron would be left flat or pinched: the direction that it is moved along.
  std::uint8_t warp = stays;
  bool refused = false;                                    ///< a warp of it was undone
  std::array<std::uint32_t, bcc::directions> neighbours{}; ///< surface points, or none: same side
  /// By direction, where the neighbour is on the other side: how far along the edge the surface is.
  std::array<double, bcc::directions> cuts{};

  bool warped() const { return warp != stays; }
};

/// The signs of the 14 neighbours of a point, as sets of directions.
struct LinkSigns {
  std::uint32_t inside = 0, outside = 0; ///< neither: on the surface
};

struct SurfacePoints {
  std::vector<BoundaryLatticePoint> points; ///< by block, word, bit

  bool other_side(const BoundaryLatticePoint& point, unsigned direction) const {
    const std::uint32_t n = point.neighbours[direction];
    return n != BoundaryLatticePoint::none && points[n].inside != point.inside;
  }
  /// Is there a cut point on the edge?
  bool is_cut(const BoundaryLatticePoint& point, unsigned direction) const {
    return !point.warped() && other_side(point, direction) &&
           !points[point.neighbours[direction]].warped();
  }
  LinkSigns link_signs(const BoundaryLatticePoint& point) const;
};

/// The direction of the nearest cut of a point that is nearer than alpha, or
/// BoundaryLatticePoint::stays. \param cuts  which edges are cut: SurfacePoints,
/// MaterialInterface
template <class Cuts, class Point>
std::uint8_t violated(const Cuts& cuts, const Point& point) {
  double least = HUGE_VAL;
  std::uint8_t result = BoundaryLatticePoint::stays;
  for (unsigned d = 0; d < bcc::directions; ++d) {
    if (!cuts.is_cut(point, d) || !(point.cuts[d] < bcc::alpha(d)))
      continue;
    const double distance = point.cuts[d] * (bcc::is_long(d) ? 1 : std::sqrt(0.75));
    if (distance < least) {
      least = distance;
      result = static_cast<std::uint8_t>(d);
    }
  }
  return result;
}

/// How the inside meets a point that lies on the surface.
enum class Meeting {
  nothing,  ///< no tetrahedron holds it
  boundary, ///< its tetrahedra make half a ball
  interior, ///< a ball
  pinched   ///< anything else: the boundary is no 2-manifold there
};
Meeting meeting(const LinkSigns& signs);

/// Finds the points and their cuts, and warps them. \throw Error as stuff()
SurfacePoints warp_lattice(const Context& context, const volume::Grid& grid,
                           const StuffingLattice& lattice, const StuffingBlocks& blocks);

} // namespace gewebe::stuffing
