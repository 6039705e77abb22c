#pragma once
// The elimination tree of a stiffness matrix, node by node, with its fronts (Liu, The multifrontal
// method for sparse matrix solution, 1992): a front eliminates some nodes and leaves to its parent
// what that means for its boundary, nodes eliminated later.

#include "cholesky/block_graph.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

struct FrontTree {
  static constexpr std::uint32_t none = UINT32_MAX;

  std::vector<std::uint32_t> sequence; ///< nodes as they are eliminated, children before parents
  std::vector<std::uint32_t> position; ///< by node: its place in it, or none where nothing is free
  std::vector<std::uint32_t> first;    ///< fronts + 1: positions that each eliminates
  std::vector<std::uint32_t> parent;   ///< by front: a later one, or none
  std::vector<std::size_t> start;      ///< fronts + 1, into
  std::vector<std::uint32_t> boundary; ///< nodes, by position

  std::size_t fronts() const noexcept { return parent.size(); }
  std::span<const std::uint32_t> eliminated(std::size_t front) const {
    return std::span(sequence).subspan(first[front], first[front + 1] - first[front]);
  }
  std::span<const std::uint32_t> boundary_of(std::size_t front) const {
    return std::span(boundary).subspan(start[front], start[front + 1] - start[front]);
  }
};

/// The tree for nodes eliminated in this order, or one that fills alike: the order is changed only
/// so that children come right before their parents. Nodes in one boundary keep their order.
/// Fronts that share most of their boundary are joined, so that a few zeros are computed with and
/// larger fronts gained. \pre `order` holds the nodes with free axes, each once
FrontTree front_tree(const BlockGraph& graph, std::span<const std::uint32_t> order);

} // namespace gewebe
