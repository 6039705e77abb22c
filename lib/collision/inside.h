#pragma once
// Whether a point lies inside a closed surface.

#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <span>

namespace gewebe::collision {

/// Winding number of triangles that face outwards round a point: 1 inside and 0 outside of a closed
/// surface to rounding, else no integer. It is the sum of solid angles (A. Van Oosterom, J.
/// Strackee, The Solid Angle of a Plane Triangle, 1983), so that the time is linear in the
/// triangles.
/// \param x  by vertex
double winding_number(std::span<const std::array<std::uint32_t, 3>> triangles,
                      std::span<const Vec3> x, const Vec3& p);

} // namespace gewebe::collision
