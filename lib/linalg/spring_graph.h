#pragma once
// Which springs pull at each node, and which nodes can move: what the sparsity of K follows from.

#include "cholesky/block_graph.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::linalg {

struct SpringGraph {
  std::vector<std::size_t> start;    ///< n + 1
  std::vector<std::uint32_t> node;   ///< at the other end, of each node in the order of the springs
  std::vector<std::uint32_t> spring; ///< of the model, that leads there
  std::vector<std::uint8_t> axes;    ///< n: how many axes of the node are free

  cholesky::BlockGraph view() const noexcept { return {start, node, axes}; }
};

/// Springs of stiffness 0 are left out. \pre check_model(model) passes
SpringGraph spring_graph(const model::Model& model);

} // namespace gewebe::linalg
