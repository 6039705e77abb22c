#pragma once
// A symmetric matrix stored by nodes, so that some of its rows can be replaced.

#include "cholesky/block_graph.h"
#include "linalg/stiffness.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::linalg {

struct NodeMatrix {
  std::vector<std::size_t> start{0};        ///< n + 1
  std::vector<std::uint32_t> node;          ///< of each row the others that it has, ascending
  std::vector<std::uint32_t> at;            ///< and which block stands there
  std::vector<std::array<double, 9>> block; ///< [3 a + b]: row a of the node, b of the other
  std::vector<SymmetricBlock> diagonal;     ///< by node
  std::vector<std::uint8_t> fixed;          ///< by node: set of FixedAxes
  std::vector<std::uint8_t> axes;           ///< by node: how many are free

  std::size_t nodes() const noexcept { return axes.size(); }
  cholesky::BlockGraph view() const noexcept { return {start, node, axes}; }
};

} // namespace gewebe::linalg
