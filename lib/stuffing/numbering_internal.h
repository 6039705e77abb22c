#pragma once
// Which points of the lattice and of its edges are nodes of the mesh, and their numbers. For the
// room alone.

#include "base/context.h"
#include "stuffing/grading_internal.h"
#include "stuffing/interface_internal.h"
#include "stuffing/lattice_internal.h"
#include "stuffing/warp_internal.h"

#include <bit>
#include <cstdint>
#include <vector>

namespace gewebe::stuffing {

/// Numbers of the mesh's nodes.
struct StuffingNodes {
  /// Of surface points: where they lie on the boundary the first is the point's own; then those of
  /// its cuts, by direction.
  std::vector<std::uint32_t> first;
  std::vector<std::uint16_t> cuts; ///< directions with a cut node, of points inside
  std::vector<Meeting> meeting;    ///< of warped points
  std::vector<PointRanks> inner;   ///< by block: nodes inside
  std::vector<std::uint32_t> first_inner;
  std::uint32_t on_surface = 0, all = 0;
  /// For an interface point: the first node of the cuts at whose end of the smaller material it
  /// is.
  std::vector<std::uint32_t> first_interface;
  std::vector<std::uint16_t> interface_cuts; ///< directions

  std::uint32_t cut(std::uint32_t point, unsigned direction) const {
    return first[point] +
           static_cast<std::uint32_t>(std::popcount(cuts[point] & ((1U << direction) - 1)));
  }
  std::uint32_t interface_cut(std::uint32_t point, unsigned direction) const {
    return first_interface[point] + static_cast<std::uint32_t>(std::popcount(
                                        interface_cuts[point] & ((1U << direction) - 1)));
  }
};

/// \throw Error if there are more than 2^32 - 2
StuffingNodes number_nodes(const Context& context, const StuffingBlocks& blocks,
                           const Grading& grading, const SurfacePoints& surface,
                           const MaterialInterface& interface);

} // namespace gewebe::stuffing
