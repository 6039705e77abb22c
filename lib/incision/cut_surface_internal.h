#pragma once
// Where parts of faces lie in the faces that they come from.

#include "geometry/vec3.h"

#include <array>
#include <cstdint>
#include <span>

namespace gewebe::incision {

/// Corners of a tetrahedron between which a node stands.
using TetSupport = std::array<bool, 4>;

/// The face of a tetrahedron (by the corner opposite to it) that holds three nodes. \pre one does
std::uint32_t face_of(std::span<const TetSupport, 3> nodes);

/// Barycentric coordinates of a place in the plane of a triangle, or of the nearest one.
std::array<double, 3> weights_in_face(const std::array<Vec3, 3>& corners, const Vec3& place);

} // namespace gewebe::incision
