#pragma once
// Which points of an isosurface snap to which corner of its lattice; for surface/snapping.cpp.

#include "base/context.h"
#include "geometry/index_map.h"
#include "surface/surface_blocks_internal.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::surface {

/// What snapping knows of a block's points.
struct SnapBlock {
  EdgeWords low, high; ///< they snap to the corner where their edge starts, where it ends
  EdgeWords merged;    ///< into another point
  EdgeWords looked_at; ///< faces here may have no area
  EdgeWords crowded;   ///< their faces may cut others
};

/// A corner or an edge by its place relative to the origin of some block; -8 … 15 along each axis.
struct LatticeEdge {
  Int3 start{};
  unsigned axis = 0;
};

/// A corner of the lattice in its block.
struct LatticeSpot {
  std::uint32_t block = SurfaceBlock::none; ///< or none, if no surface is near
  unsigned slice = 0, bit = 0;
  std::size_t word(unsigned axis) const { return 3 * slice + axis; }
};

/// A point that snaps by the fin rule.
struct SnapFin {
  Int3 corner{}; ///< where it snaps to
  std::uint32_t point = 0;
  Int3 start{}; ///< of its edge
  unsigned axis = 0;
};

/// A face of a point's star: the corners that follow it, and the block of its cell.
struct StarFace {
  std::uint32_t block = 0;
  LatticeEdge a, b;
};

/// Steps 1 and 2 of `snap`.
class SnapLattice {
public:
  /// Blocks are those of the surface in their order, then others with a corner that draws points.
  /// \param kept  corners, ascending, that draw only points that lie on them
  SnapLattice(const Context& context, const SurfaceBlocks& surface, double epsilon, bool mirrored,
              std::span<const Int3> kept = {});

  const SurfaceBlocks& surface() const { return surface_; }
  std::size_t count() const { return surface_.blocks.size() + further_.size(); }
  const SurfaceBlock& block(std::size_t n) const {
    return n < surface_.blocks.size() ? *surface_.blocks[n] : further_[n - surface_.blocks.size()];
  }
  const SnapBlock& snaps(std::size_t n) const {
    return n < surface_.blocks.size() ? snaps_[n] : nothing;
  }
  SnapBlock& snaps(std::size_t n) { return snaps_[n]; } ///< \pre a block of the surface
  bool mirrored() const { return mirrored_; }

  /// The corners of block n that draw a point, and those that draw several.
  struct Corners {
    CornerWords some{}, several{};
  };
  Corners corners(std::size_t n) const;

  const std::vector<SnapFin>& fins() const { return fins_; } ///< by corner, then by point
  std::span<const SnapFin> fins_at(const Int3& corner) const;
  const SnapFin& fin_of(std::uint32_t point) const; ///< \pre it is one
  /// The fins among the points of a block; \pre fins() isn't empty
  const EdgeWords& fins_in(std::size_t n) const { return fin_[n]; }
  bool draws_fin(std::size_t n, const LatticeSpot& at) const {
    return !fin_draws_.empty() && (fin_draws_[n].at(at.slice) >> at.bit & 1) != 0;
  }
  bool is_fin(std::size_t n, const LatticeEdge& edge) const {
    const LatticeSpot at = spot(n, edge.start);
    return !fin_.empty() && (fin_[at.block].at(at.word(edge.axis)) >> at.bit & 1) != 0;
  }

  // The rest is for the few points where bits don't do; places are relative to block n.
  LatticeSpot spot(std::size_t n, const Int3& corner) const {
    const std::size_t place =
        SurfaceBlock::neighbour_place(corner[0] >> 3, corner[1] >> 3, corner[2] >> 3);
    return {place == 13 ? static_cast<std::uint32_t>(n) : block(n).neighbours.at(place),
            static_cast<unsigned>(corner[0] & 7),
            static_cast<unsigned>(8 * (corner[1] & 7) + (corner[2] & 7))};
  }
  std::uint32_t point_on(const LatticeSpot& spot, unsigned axis) const {
    return block(spot.block).point(spot.word(axis), spot.bit);
  }
  /// The corner that the point on an edge snaps to, fins apart; false if to none.
  bool snap_corner(std::size_t n, const LatticeEdge& edge, Int3& corner) const;
  /// The first point that snaps to a corner, fins apart, or none.
  std::uint32_t first_member(std::size_t n, const Int3& corner) const;
  /// Calls visit(edge) for each edge whose point snaps to a corner, fins apart.
  template <class Visit>
  void for_members(std::size_t n, const Int3& corner, Visit&& visit) const;
  /// Appends the faces round the point on an edge in their order.
  void append_star(std::size_t n, const LatticeEdge& edge, std::vector<StarFace>& faces) const;
  Int3 from_origin(std::size_t n, const Int3& corner) const; ///< of an absolute corner
  Int3 absolute(std::size_t n, const Int3& corner) const;
  double fraction(std::uint32_t point) const { return surface_.fractions[point]; }

private:
  void classify(const Context& context, double epsilon);
  void keep(std::span<const Int3> corners);
  /// Found from a block of the surface along an axis.
  struct Missing {
    Int3 origin{};
    std::uint32_t found_by = 0;
    unsigned axis = 0;
  };
  void add_further_blocks(std::vector<Missing> missing);
  void apply_fin_rule(const Context& context);
  bool find_fin(std::size_t n, const LatticeEdge& edge, SnapFin& fin) const;
  const SnapBlock& neighbour(const SurfaceBlock& block, int x, int y, int z) const {
    const std::uint32_t number = block.neighbours[SurfaceBlock::neighbour_place(x, y, z)];
    return number == SurfaceBlock::none ? nothing : snaps_[number];
  }
  EdgeWords fin_candidates(std::size_t n) const;

  const SurfaceBlocks& surface_;
  bool mirrored_;
  std::vector<SurfaceBlock> further_;
  IndexMap further_numbers_;
  std::unique_ptr<SnapBlock[]> snaps_;
  std::vector<SnapFin> fins_, fins_by_point_;
  std::vector<EdgeWords> fin_;         // of each block, if there are any
  std::vector<CornerWords> fin_draws_; // corners that draw one

public:
  static constexpr SnapBlock nothing{}; ///< of a block without points
};

template <class Visit>
void SnapLattice::for_members(std::size_t n, const Int3& corner, Visit&& visit) const {
  for (unsigned axis = 0; axis < 3; ++axis)
    for (const int back : {1, 0}) {
      LatticeEdge edge{corner, axis};
      edge.start.at(axis) -= back;
      const LatticeSpot at = spot(n, edge.start);
      if (at.block == SurfaceBlock::none)
        continue;
      const SnapBlock& block = snaps(at.block);
      if (((back != 0 ? block.high : block.low).at(at.word(axis)) >> at.bit & 1) != 0)
        visit(edge);
    }
}

} // namespace gewebe::surface
