#pragma once
// Nodes that lie together.

#include "base/vec3.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// Nodes by cluster, ascending in each.
struct NodeClusters {
  std::vector<std::uint32_t> node;
  std::vector<std::uint32_t> first{0}; ///< where each cluster begins in `node`, and their end

  std::size_t size() const noexcept { return first.size() - 1; }
  std::span<const std::uint32_t> nodes(std::size_t cluster) const {
    return std::span(node).subspan(first[cluster], first[cluster + 1] - first[cluster]);
  }
};

/// Appends clusters of `most` nodes or fewer: halves of their box across its longest side, again
/// and again, with as many nodes in both. \pre most > 0, positions of the nodes are finite
void append_clusters(std::span<const Vec3> positions, std::span<const std::uint32_t> nodes,
                     std::size_t most, NodeClusters& to);

} // namespace gewebe
