#pragma once
// Normals of a triangulated surface at its vertices and edges.

#include "collision/surface.h"
#include "geometry/vec3.h"

#include <cstdint>
#include <span>

namespace gewebe::collision {

/// Normal of the surface at a feature, and how flat the surface is there.
struct FeatureNormal {
  Vec3 normal;     ///< unit; 0 without triangles
  double flat = 0; ///< |sum of area normals| over the sum of areas: 1 where triangles are coplanar
};

/// Average normal of the triangles around a vertex or an edge. Their weight is the area times
/// |n . direction|^8, and normals that point away from `direction` are reversed: the far side of a
/// rim and the back of a sheet do not count.
/// \param feature  one vertex, or both of an edge
/// \param direction  unit
FeatureNormal feature_normal(const CollisionSurface& surface, std::span<const Vec3> x,
                             std::span<const std::uint32_t> feature, const Vec3& direction);

} // namespace gewebe::collision
