#pragma once
// Exact test of an edge against a triangle.

#include "geometry/vec3.h"

namespace gewebe::collision {

/// Whether the edge p q and the triangle a b c have a point in common; exact, by the signs of
/// geometry/exact_predicates.h. A triangle without area intersects nothing; its edges are tested
/// with other triangles.
/// \pre coordinates as there
bool edge_meets_triangle(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b, const Vec3& c);

} // namespace gewebe::collision
