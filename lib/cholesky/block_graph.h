#pragma once
// The sparsity of a symmetric matrix by its nodes; a node stands for up to three rows.

#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe::cholesky {

/// A view: neighbours of node i are node[start[i] … start[i + 1] - 1], in any order, both ways and
/// without the node itself; some may be named more than once.
struct BlockGraph {
  std::span<const std::size_t> start;  ///< n + 1
  std::span<const std::uint32_t> node; ///< at the other end
  std::span<const std::uint8_t> axes;  ///< n: rows that each stands for, 0 to 3

  std::size_t nodes() const noexcept { return axes.size(); }
  std::span<const std::uint32_t> of(std::size_t i) const {
    return node.subspan(start[i], start[i + 1] - start[i]);
  }
};

} // namespace gewebe::cholesky
