#pragma once
// Which cells of a stuffed solid are smaller. For the room alone.

#include "base/context.h"
#include "stuffing/background_internal.h"
#include "stuffing/cut_finder_internal.h"
#include "stuffing/grading_internal.h"
#include "stuffing/lattice_internal.h"
#include "stuffing/octree_internal.h"
#include "stuffing/stuffing.h"
#include "tetrahedra/refinement.h"
#include "volume/grid.h"

#include <vector>

namespace gewebe::stuffing {

/// Cells may be halved so often.
inline constexpr unsigned refined_levels_max = 8;

/// Makes octrees of the cells at a solid, halved where a region needs it. Level `levels()` has the
/// cells of the lattice.
class RefinedCells {
public:
  /// \pre all of them outlive it \throw Error if a region does not suit the lattice
  RefinedCells(const volume::Grid& grid, const StuffingLattice& lattice,
               const StuffingOptions& options);

  unsigned levels() const { return levels_; }
  /// May a region reach into the block at this place of the lattice?
  bool meets_block(const Int3& origin) const;
  /// Cells with a point inside and those round them, halved in the regions, balanced.
  StuffingOctree octree(const Context& context, const StuffingBlocks& blocks,
                        const Grading& grading) const;
  /// Halves leaves in the regions, and balances.
  void refine(StuffingOctree& octree) const;
  /// \throw Error if spheres and boxes of a region are away from what is inside
  void require_met(const Background& background, const std::vector<bool>& inside) const;

private:
  struct Probe {
    CutFinder finder;
    MaterialAt material;
  };
  Probe probe() const;
  // Cubes by their first corner, in places of the lattice, and edge.
  bool meets_shape(const tetrahedra::RefinedRegion& region, const Vec3& first, double edge) const;
  bool meets(const tetrahedra::RefinedRegion& region, const Vec3& first, double edge,
             Probe& probe) const;
  bool has_inside(const Vec3& first, Probe& probe) const;
  Vec3 place_of(const OctreeCube& cube) const;

  const volume::Grid& grid_;
  const StuffingLattice& lattice_;
  const std::vector<tetrahedra::RefinedRegion>& regions_;
  const MaterialSource& materials_;
  unsigned levels_ = 0;
};

} // namespace gewebe::stuffing
