#pragma once
// Clusters of nodes that are near each other.

#include "geometry/vec3.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::columns {

/// Nodes by cluster, ascending in each.
struct NodeClusters {
  std::vector<std::uint32_t> node;
  std::vector<std::uint32_t> first{0}; ///< where each cluster begins in `node`, and their end

  std::size_t size() const noexcept { return first.size() - 1; }
  std::span<const std::uint32_t> nodes(std::size_t cluster) const {
    return std::span(node).subspan(first[cluster], first[cluster + 1] - first[cluster]);
  }
};

/// Appends clusters of `most` nodes or fewer, by recursive bisection: the nodes are divided across
/// the longest side of their box into two halves of equal size.
/// \pre most > 0, positions of the nodes are finite
void append_clusters(std::span<const Vec3> positions, std::span<const std::uint32_t> nodes,
                     std::size_t most, NodeClusters& to);

} // namespace gewebe::columns
