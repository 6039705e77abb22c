#pragma once
// Memory layout of a model's springs for fast sums. Nodes that are near each other in space lie
// near each other in memory, in blocks that fit the L1 cache. A spring within a block is computed
// once, a spring between blocks once for each end. Blocks can therefore be stepped in any order, by
// any number of threads, with the same bytes.

#include "dynamics/spring_kernel.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::dynamics {

struct SpringLayout {
  std::vector<std::uint32_t> node_of_row; ///< movable nodes, block by block, then the others
  std::vector<std::uint32_t> row_of_node;
  std::vector<NodeRest> rest; ///< by row
  std::size_t movable = 0;    ///< rows that can move along an axis or more
  std::vector<SpringGroup> groups;
  std::vector<SpringBlock> blocks; ///< point into groups: the layout is not copied

  SpringLayout() = default;
  SpringLayout(SpringLayout&&) = default;
  SpringLayout& operator=(SpringLayout&&) = default;
  SpringLayout(const SpringLayout&) = delete;
  SpringLayout& operator=(const SpringLayout&) = delete;

  std::uint64_t pulls() const; ///< forces of springs that a step computes
};

/// Forms blocks by recursive bisection of the rest positions along the longest side. The result is
/// the same on every machine. \pre check_model(model) passes
SpringLayout spring_layout(const model::Model& model);

} // namespace gewebe::dynamics
