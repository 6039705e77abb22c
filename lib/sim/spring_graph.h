#pragma once
// Which springs pull at each node, and which nodes can move: what the sparsity of K follows from.

#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

struct SpringGraph {
  struct Arm {
    std::uint32_t node = 0;   ///< at the other end
    std::uint32_t spring = 0; ///< of the model
  };
  std::vector<std::size_t> start; ///< n + 1
  std::vector<Arm> arms;          ///< of each node, in the order of the springs
  std::vector<std::uint8_t> axes; ///< n: how many axes of the node are free

  std::span<const Arm> of(std::uint32_t node) const {
    return std::span(arms).subspan(start[node], start[node + 1] - start[node]);
  }
};

/// Springs of stiffness 0 are left out. \pre check_model(model) passes
SpringGraph spring_graph(const Model& model);

} // namespace gewebe
