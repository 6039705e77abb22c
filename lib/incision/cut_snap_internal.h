#pragma once
// Selection of nodes that replace crossings near them, so that no tetrahedron becomes too sharp.

#include "incision/cut_region_internal.h"
#include "incision/cut_split_internal.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::incision {

/// By local nodes.
struct SnappedRegion {
  std::vector<Vec3> points;         ///< at rest, some of them moved
  std::vector<bool> on;             ///< whether the wound passes through the node
  std::vector<std::uint32_t> along; ///< the crossed edge along which it was moved, or no_crossing
  std::uint64_t moved = 0, kept = 0;
  double largest_miss = 0;
};

/// The crossings of a tetrahedron that are left, in the order in which it is halved at them.
/// `node` is the number of local nodes plus that of the crossed edge.
std::vector<EdgeNode> edge_nodes(const CutRegion& region, const std::vector<bool>& on,
                                 const RegionTet& tet);

/// \throw Error as cut_tetrahedra, of the region
SnappedRegion snap_region(const tetrahedra::TetMesh& mesh, const CutRegion& region,
                          const BladeCutOptions& options);

} // namespace gewebe::incision
