#pragma once
// Joins points at equal position, so that triangles which touch share their corners.

#include "geometry/mesh.h"

#include <cstddef>
#include <cstdint>

namespace gewebe::repair {

/// Which points at exactly equal position (-0 equals 0) become one.
enum class Weld {
  none,    ///< none
  part,    ///< those that triangles of one part use
  borders, ///< those of `part`; then, across parts, those that lie on an open border
  all,     ///< all
};

struct WeldOptions {
  Weld mode = Weld::borders;
  /// Remove triangles two of whose corners are the same point; a triangle without area whose
  /// corners are three points stays.
  bool drop_degenerate = true;
  bool drop_unused = false; ///< remove points that no triangle uses
};

struct WeldResult {
  std::uint64_t points_before = 0;
  std::uint64_t points_after = 0;
  std::uint64_t welded = 0;              ///< points that were joined to an earlier one
  std::uint64_t welded_across_parts = 0; ///< those of them that only the borders rule joined
  std::uint64_t unused_removed = 0;      ///< points
  std::uint64_t degenerate_removed = 0;  ///< triangles
};

/// Welds in place. A mesh without part numbers is one part. Points keep the order of their first
/// occurrence, and the first one's normal; triangles keep their order; texture coordinates belong
/// to corners and are not touched. Points that the mesh shares already stay shared, between parts
/// too.
///
/// The borders rule: after welding inside each part, an edge (an unordered pair of points) is open
/// if exactly one triangle has it, and a point is on a border if it ends an open edge. Border
/// points at equal position are joined, whatever their part. Two closed parts that touch stay two
/// parts, for none of their edges is open; patches that make up one surface become that surface.
/// Welding again changes nothing. \pre check_mesh(mesh) passes
WeldResult weld(TriangleMesh& mesh, const WeldOptions& options);

} // namespace gewebe::repair
