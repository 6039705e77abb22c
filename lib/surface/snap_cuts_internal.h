#pragma once
// Which faces of a snapped mesh cut each other; for surface/snapping.cpp.

#include "base/context.h"
#include "geometry/mesh.h"
#include "surface/surface_blocks_internal.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::surface {

/// Of each case of a cell: the direction from its corners inside to those outside, in the world, of
/// length 1; 0 where none leads out of the cell more than another.
using CellDirections = std::array<Vec3, 256>;
CellDirections make_directions(const volume::GridTransform& transform);

/// Does a face look out of its cell at 60 degrees or more from the cell's direction?
/// \param normal  of any length
inline bool is_turned(const Vec3& normal, const Vec3& direction) {
  const double out = dot(normal, direction);
  return !(out > 0 && out * out > 0.25 * dot(normal, normal));
}

/// A mesh whose faces lie in the blocks of a surface in turn.
struct SnappedFaces {
  const TriangleMesh& mesh;
  const SurfaceBlocks& surface;
  const volume::GridTransform& transform;
  std::span<const std::uint32_t> first_face; ///< of each block, and their end
};

/// A face of the mesh and the block of its cell.
struct SuspectFace {
  std::uint32_t block = 0, face = 0;
  bool turned = false;
};

/// Finds faces that cut others: each suspect, and each face near one that is turned, is compared
/// with the faces that its box meets. \return ascending
std::vector<std::uint32_t> find_cutting_faces(const Context& context, const SnappedFaces& snapped,
                                              std::vector<SuspectFace> suspects);

} // namespace gewebe::surface
