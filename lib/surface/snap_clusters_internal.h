#pragma once
// Which points of an isosurface snap to which corner of the lattice; for surface/snapping.cpp.

#include "base/context.h"
#include "base/index_map.h"
#include "surface/marching_cubes.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe {

// Flags of a point.
inline constexpr unsigned snaps_low = 1;  ///< to the corner where its edge starts
inline constexpr unsigned snaps_high = 2; ///< to the one where it ends
inline constexpr unsigned clustered = 4;  ///< is in a cluster of two points or more
inline constexpr unsigned may_be_fin = 8; ///< snaps nowhere, as opposed to all its neighbours
inline constexpr unsigned fin = 16;       ///< snaps by the fin rule
inline constexpr unsigned merged = 32;    ///< was merged into another point
inline constexpr unsigned looked_at = 64; ///< faces here may have no area

/// The corner that the point snaps to. \pre it snaps low or high
inline Int3 snap_corner(const EdgeCrossing& crossing, unsigned flags) {
  Int3 corner = crossing.corner;
  if ((flags & snaps_low) == 0)
    ++corner[static_cast<std::size_t>(crossing.axis)];
  return corner;
}

/// The clusters of at least two points. Slots are places in `members`.
struct SnapClusters {
  std::unique_ptr<std::uint8_t[]> flags;   ///< of each point
  std::unique_ptr<std::uint32_t[]> slot;   ///< of each point that is clustered; else not set
  std::vector<std::uint32_t> members;      ///< points, ascending in each cluster
  std::vector<std::uint32_t> cluster;      ///< of each slot
  std::vector<std::uint32_t> begin;        ///< of each cluster's slots, and their end
  std::vector<std::uint32_t> first_member; ///< of each cluster, fins apart: what orders clusters
  std::uint64_t corners = 0;               ///< that drew a crossing
  std::uint64_t fins = 0;

  std::size_t count() const { return first_member.size(); }
  std::span<const std::uint32_t> members_of(std::size_t n) const {
    return {members.data() + begin[n], members.data() + begin[n + 1]};
  }
};

/// Steps 1 and 2 of `snap`.
/// \throw Error if the points are not in the order that marching_cubes gives them
SnapClusters find_snap_clusters(const Context& context, const IsoSurface& surface, double epsilon);

} // namespace gewebe
