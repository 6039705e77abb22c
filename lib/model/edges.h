#pragma once
// The unique edges of a set of triangles, each with the faces that meet in it.

#include "base/context.h"
#include "base/mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// Edge e joins ends[e][0] < ends[e][1]; edges ascend by their ends. The faces in an edge are given
/// by the corner that lies opposite: corners[first[e] … first[e+1]) holds 3 face + k, ascending.
struct EdgeTable {
  std::vector<std::array<std::uint32_t, 2>> ends;
  std::vector<std::uint32_t> first; ///< one more than edges
  std::vector<std::uint32_t> corners;

  std::size_t size() const { return ends.size(); }
  std::span<const std::uint32_t> around(std::size_t edge) const {
    return {corners.data() + first[edge], corners.data() + first[edge + 1]};
  }
};

/// \pre corners are below `point_count`, those of a triangle differ
/// \throw Error if there are more than 2^32 / 3 triangles
EdgeTable edge_table(std::span<const Triangle> triangles, std::size_t point_count,
                     const Context& context);

} // namespace gewebe
