#pragma once
// Removes faces without area by flipping their longest edges; for surface/snapping.cpp.

#include "geometry/mesh.h"

#include <cstdint>
#include <vector>

namespace gewebe::surface {

/// Is the area 0, relative to the square of the longest edge? In the world, where positions on the
/// lattice are rounded, `tolerance` must be larger than in index space.
bool has_no_area(const Vec3& a, const Vec3& b, const Vec3& c, double tolerance = 1e-12);
inline constexpr double world_tolerance = 1e-9;

/// Flips the longest edge of each flat face, whose third corner lies on that edge, until none is
/// left or no flip is possible. The surface stays the same set of points, and so does its topology:
/// an edge that exists already is never made. Time grows with the faces of the mesh.
/// \param flat  faces without area; the result is those that are left, ascending
/// \pre the mesh is closed, oriented and 2-manifold
std::vector<std::uint32_t> flip_flat_faces(TriangleMesh& mesh, std::vector<std::uint32_t> flat);

} // namespace gewebe::surface
