#pragma once
// Faces that stand twice in a mesh.

#include "geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::mesh {

/// Which faces count as the same one.
enum class SameFace {
  corners,     ///< those with the same three corners
  orientation, ///< of them those that run the same way round
};

/// True for each face that repeats an earlier one. `part` is empty or has the part of each face;
/// then faces of different parts are never the same. Time grows with points and faces (those of one
/// smallest corner are sorted).
/// \pre corners are below `points`; for `orientation` those of a face differ
std::vector<bool> repeated_faces(std::size_t points, std::span<const Triangle> triangles,
                                 SameFace same, std::span<const std::int32_t> part = {});

} // namespace gewebe::mesh
