#pragma once
// Orientation of closed triangle meshes, so that sums over their faces tell inside from outside.

#include "geometry/mesh.h"

#include <cstdint>
#include <vector>

namespace gewebe::repair {

/// What became of a mesh.
struct OrientReport {
  std::uint64_t parts = 0;   ///< groups of triangles that hang together by edges
  std::uint64_t flipped = 0; ///< triangles whose corners were reordered
};

/// Reorders the corners of triangles so that each edge (by the positions of its ends) is run
/// through as often in the one direction as in the other: the triangles are then a closed chain,
/// and the winding number of a point is even outside and odd inside by the parity rule. An
/// orientation that is already such a chain stays within each part. Parts are turned so that they
/// bound a positive volume, those in an odd number of others a negative one: where no faces cut
/// each other the winding number is then 1 inside and 0 outside.
///
/// Returns false, `triangles` as they were, where there is no such order that agrees across edges
/// of two triangles: a mesh with boundary edges, a one-sided surface, or badly oriented sheets that
/// meet in edges of four triangles and more. \pre check_mesh passes
bool orient_closed(const std::vector<Vec3>& points, std::vector<Triangle>& triangles,
                   OrientReport* report = nullptr);

} // namespace gewebe::repair
