#pragma once
// A triangle soup as an oriented surface: neighbours made to agree, parts turned outward, what is
// missing of its border named. For the winding number, which depends on orientation.

#include "geometry/mesh.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::repair {

struct OrientedSurface {
  std::vector<Triangle> triangles;    ///< corners are the first points at their positions
  std::vector<std::uint32_t> source;  ///< of each, the triangle that was given; ascending
  std::uint64_t parts = 0;            ///< connected by edges, within the parts of the input
  std::uint64_t parts_turned = 0;     ///< turned as a whole, since their signed volume was negative
  std::uint64_t triangles_turned = 0; ///< that run against most of their patch
  std::uint64_t triangles_duplicate = 0; ///< left out: same part, same corners, same orientation
};

/// Orients the triangles. A patch is what edges with exactly two triangles connect; within it all
/// triangles agree with the larger area. A part is what edges of any kind connect; it is turned as
/// a whole if its volume about the middle of its points is negative. Degenerate triangles are left
/// out. `part` is empty or has the part of each triangle; triangles of different parts are never
/// neighbours. The result depends on the order of nothing but equal areas.
OrientedSurface orient_surface(std::span<const Vec3> points, std::span<const Triangle> triangles,
                               std::span<const std::int32_t> part);

/// A chain that closes a surface, so that every edge is run through as often one way as the other.
struct ClosingCones {
  std::vector<Triangle> cones;  ///< one triangle for each missing edge, one for a loop of three
  std::vector<Triangle> pieces; ///< the same up to rounding, cut so that no piece is long and thin
};

/// The unbalanced edges are taken apart into simple loops, and each longer than three edges gets a
/// cone to a point near the mean of its points; new points are added to `points`. Empty if the
/// surface is closed. \pre equal positions have equal indices in `triangles`
ClosingCones closing_cones(std::vector<Vec3>& points, std::span<const Triangle> triangles);

} // namespace gewebe::repair
