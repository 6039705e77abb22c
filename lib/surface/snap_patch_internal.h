#pragma once
// Merges clusters of points on the edges at one corner by bit operations; for
// surface/snap_collapse.cpp.
//
// Every cell with one of those edges has that corner, so all neighbours of the points lie on the
// edges of 2³ cells: a patch of 3³ corners. Corner (x, y, z) of a patch, 0 … 2, has place
// 9 y + 3 x + z.

#include "surface/snap_lattice_internal.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace gewebe::surface {

/// Bits of the corners of a patch.
using PatchCorners = std::uint32_t;

/// Edges of a patch by their start and axis: x in bits 0 … 26, y in bits 27 … 53, z on its own.
struct PatchEdges {
  std::uint64_t xy = 0;
  std::uint32_t z = 0;
};

/// Result for a cluster. Its members are numbered by direction: 2 axis for the point on the
/// edge that leads up from the corner, 2 axis + 1 for that on the edge from below.
struct PatchMerges {
  struct Group {
    std::size_t count = 0;
    std::array<std::uint8_t, 6> members{}; ///< the target, then the points merged into it, in order
  };
  std::size_t count = 0;
  std::array<Group, 3> groups{};
  std::size_t left = 0;                   ///< points of the cluster that are left
  std::array<std::uint8_t, 8> vanished{}; ///< faces of the cell on the side (n & 1, n >> 1 & 1,
                                          ///< n >> 2) of the corner; 1 is the far side
};

/// Merges the clusters of one block after the other.
class SnapPatches {
public:
  explicit SnapPatches(const SnapLattice& lattice) : lattice_(lattice) {}
  /// Goes to block n, for corners in the slices whose bits are set.
  void enter(std::size_t n, unsigned slices);
  /// Merges the cluster at a corner of the block if it satisfies the conditions of
  /// merge_snap_clusters; else returns false. \pre it draws no fin
  bool take(unsigned slice, unsigned bit, PatchMerges& result);
  /// Whether the surface in the cells round the corner is a single sheet. It is if two conditions
  /// hold. Lines along one axis intersect it once at most, all in the same sense, and one at the
  /// corner. The corner has no two opposite neighbours on the other side.
  /// \pre enter(n, slices) with this slice
  bool is_single_sheet(unsigned slice, unsigned bit) const;

  static constexpr std::size_t padded = 10;

private:
  // Padded bits of the block and of what lies round it: bit k + 1 of row j + 1 of slice i + 1.
  enum Set { inside, low, high = low + 3, fin = high + 3, sets = fin + 3 };
  using Rows = std::array<std::uint16_t, padded * padded + 4>; // a window is read by 4 rows

  const SnapLattice& lattice_;
  std::array<Rows, sets> rows_{};
  bool has_fins_ = false;
};

} // namespace gewebe::surface
