#pragma once
// Does a mesh cut itself?

#include "base/context.h"
#include "geometry/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::mesh {

struct SelfIntersections {
  std::uint64_t pairs = 0;            ///< of faces that meet in more than what they share
  std::vector<std::uint32_t> faces;   ///< that are in such a pair, ascending
  std::uint64_t degenerate_faces = 0; ///< corners on one line; not tested
  std::uint64_t pairs_tested = 0;     ///< with meeting boxes
};

/// Finds the pairs of faces that meet elsewhere than in the corners (by index) and the edge that
/// they share: touching counts, and so does a fold that lays one neighbour on the other. Decided by
/// exact predicates on the points as they are, so never wrong. Time n log n for ordinary meshes.
/// \pre check_mesh(mesh) passes
SelfIntersections self_intersections(const Context& context, const TriangleMesh& mesh);

/// The test of two faces, for callers that choose the pairs. Refers to the mesh.
class FaceIntersections {
public:
  explicit FaceIntersections(const TriangleMesh& mesh);
  bool degenerate(std::size_t face) const;
  /// \pre the faces differ and neither is degenerate
  bool meet(std::size_t f, std::size_t g) const;

private:
  std::array<Vec3, 3> corners(std::size_t face) const; ///< scaled for the predicates
  const TriangleMesh& mesh_;
  double scale_ = 1;
};

} // namespace gewebe::mesh
