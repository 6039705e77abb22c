#pragma once
// Normals of a triangulated surface at its vertices and edges.

#include "collision/surface.h"
#include "geometry/vec3.h"

#include <cstdint>
#include <span>

namespace gewebe::collision {

/// Normal of the surface at a point, and how flat the surface is there.
struct SurfaceNormal {
  Vec3 normal;     ///< unit; 0 without triangles
  double flat = 0; ///< |sum of area normals| over the sum of areas: 1 where triangles are coplanar
};

/// Normal at a point of a vertex, an edge or a triangle: interpolated between vertices, where it is
/// the average of the triangles around.
///
/// A triangle has the weight area |n . direction|^8, and n is reversed where it points away from
/// `direction`: the far side of a rim and the back of a sheet do not count.
///
/// \param vertices,weights  the point is the sum of weight times vertex; signs do not matter
/// \param direction  unit
SurfaceNormal surface_normal(const CollisionSurface& surface, std::span<const Vec3> x,
                             std::span<const std::uint32_t> vertices,
                             std::span<const double> weights, const Vec3& direction);

} // namespace gewebe::collision
