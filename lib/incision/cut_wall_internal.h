#pragma once
// The parts of the tetrahedra near a blade, the wall between those above and those below, and the
// pieces into which the tetrahedra round each node fall along it.

#include "incision/cut_region_internal.h"
#include "incision/cut_snap_internal.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gewebe::incision {

/// Nodes are local ones, then crossings.
struct TetPart {
  Tetrahedron corners{};
  std::uint32_t parent = 0;                 ///< of the region
  std::int8_t side = 0;                     ///< 1 above the blade, -1 below, 0 not said
  std::array<std::uint32_t, 4> neighbour{}; ///< 4 part + k across face k, or no_neighbour
  std::array<bool, 4> wall{};               ///< whether face k is on the wall
  std::array<std::uint32_t, 4> piece{};     ///< of each corner: its number among the node's pieces
};

inline constexpr std::uint32_t no_neighbour = UINT32_MAX;

struct PartedRegion {
  std::vector<TetPart> parts; ///< by parent
  /// By node, ascending: those at which there is a wall.
  struct Piece {
    std::uint32_t node = 0, pieces = 1;
    std::uint32_t largest = 0; ///< which of them has the most volume
  };
  std::vector<Piece> nodes;
  std::uint64_t rejoined = 0, opened = 0;
  bool needs_more = false; ///< a wider region would let more faces be opened
};

/// \throw Error if there are too many parts
PartedRegion part_region(const CutRegion& region, const SnappedRegion& snapped);

} // namespace gewebe::incision
