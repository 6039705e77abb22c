#pragma once
// How far the nodes of a shape that is not known are displaced at most.

#include <cstdint>
#include <memory>
#include <vector>

namespace gewebe {

/// By groups of nodes: no entry of a node's displacement is larger than what its group has.
struct NodeReach {
  std::shared_ptr<const std::vector<std::uint32_t>> group; ///< of each node that the shape has
  std::vector<double> most;                                ///< mm, by group
};

} // namespace gewebe
