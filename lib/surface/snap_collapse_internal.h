#pragma once
// Merges the points of each cluster as far as the mesh stays valid; for surface/snapping.cpp.

#include "surface/snap_lattice_internal.h"
#include "surface/snapping.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace gewebe::surface {

/// Result of the merges. Steps of `snap` mark points in the lattice's SnapBlocks. `merged`: the
/// point was merged into another. `looked_at`: others were merged into it. `crowded`: another point
/// of the same corner is left, or, with Place::corner, the surface isn't a single sheet there.
struct SnapMerges {
  struct Place {
    std::uint32_t point = 0;
    Vec3 position; ///< in index space
    bool operator==(const Place&) const = default;
  };
  std::unique_ptr<std::uint32_t[]> target; ///< of each point that was merged: into which
  std::vector<std::vector<Place>> places;  ///< of points that others were merged into
  std::vector<std::uint32_t> dropped;      ///< of each block: faces of its cells that vanish
  std::uint64_t clusters = 0;              ///< of two points or more
  std::uint64_t corners = 0;               ///< that drew a crossing
  std::uint64_t refused = 0;
  std::uint64_t careful = 0; ///< clusters that had to be taken in order
};

/// Step 3 of `snap`: a face vanishes if two of its corners have the same target.
///
/// The result is that of taking one cluster after the other, ordered by first_member. Most clusters
/// need no order. Let p q be an edge in cluster A, N(p) and N(q) the neighbours in the mesh that
/// only A's collapses so far have changed, and let the label of a point be its cluster, or itself
/// where it has none. Suppose that
///
///    (1) p and q have exactly two common neighbours x and y,
///    (2) no label of N(p) \ {q, x, y} is one of N(q) \ {p, x, y},
///    (3) N(p) or N(q) has four labels at least.
///
/// Then the link condition holds for p q whatever the other clusters did before. For they only
/// merge points of equal label, and never two of A, so that N(p) then consists of the images of
/// N(p) now. Images are equal only where labels are, so by (2) no image of N(p) \ {q, x, y} is one
/// of N(q) \ {p, x, y}, unless it is that of x or y; and x and y stay apart, since the collapses
/// made keep the mesh a 2-manifold without double faces, where an edge has two different points
/// opposite. So exactly two common neighbours are left, and by (3) p q is no edge of a tetrahedron.
/// Faces with two points of A vanish by A alone, so the edges inside A are met in the same order
/// too. A cluster all of whose collapses, made in the mesh as it was at first, satisfy (1) to (3)
/// thus ends the same in any order, and such clusters are taken in parallel. The others follow one
/// by one in their order, each in the mesh as the clusters before it leave it.
///
/// Nearly all clusters have no fin, and none among their neighbours: bits detect these (see
/// snap_patch_internal.h). There the label of a point is the corner that it snaps to, or itself
/// where it snaps nowhere or to the cluster's own corner. That says the same: two points snap to
/// one corner if and only if they are in one cluster. (2) is tested for all corners at once; for
/// (3) the neighbours that have themselves as label are counted, and the different corners of the
/// others. The edges inside A are met in the order of faces, which a corner's place in its block
/// decides.
///
/// \param always_careful takes all in order (for tests)
SnapMerges merge_snap_clusters(const Context& context, SnapLattice& lattice,
                               SnapOptions::Place place, bool always_careful = false);

} // namespace gewebe::surface
