#pragma once
// Triangles cut into sheets that agree, and their half-edges: what algorithms on two-manifolds ask
// for. Both look at each corner a few times and walk round no point, so that a point under many
// faces costs what they do.

#include "geometry/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::mesh {

/// Each edge is of one face, or of two that run along it in opposite directions, and the faces at
/// each point hang together by such edges.
struct Sheets {
  std::vector<Triangle> triangles;   ///< in the order given
  std::vector<char> backward;        ///< of each, whether it runs the other way: {c, b, a}
  std::vector<std::uint32_t> origin; ///< of each point the one that was given; these come first
};

/// Neighbours are turned to agree with the first face of what hangs together by edges of two faces.
/// Edges of more faces, and those where a one-sided surface closes, are cut; then each point has a
/// copy for every group of faces but the first that meets there in no edge. Time grows as that of
/// EdgeSides.
/// \pre corners are below `points`, no face has equal corners   \throw Error as EdgeSides
Sheets cut_into_sheets(std::size_t points, std::span<const Triangle> triangles);

/// Edge e is the half-edges 2e, as the first of its faces runs, and 2e + 1. Those without a face
/// are the border. Edges are numbered by face, in each from its first corner on.
struct HalfEdges {
  static constexpr std::uint32_t none = UINT32_MAX;
  std::vector<std::uint32_t> target; ///< the point it leads to
  std::vector<std::uint32_t> next;   ///< round the face, or along the border
  std::vector<std::uint32_t> face;   ///< or none
  /// Of each point one that leads there: at the border, or else of the last face; or none.
  std::vector<std::uint32_t> of_point;
  std::vector<std::uint32_t> of_face; ///< the one to its first corner
};

/// Time grows as that of EdgeSides.
/// \pre the triangles are sheets (see there)
HalfEdges half_edges(std::size_t points, std::span<const Triangle> triangles);

} // namespace gewebe::mesh
