#pragma once
// Elimination tree of a stiffness matrix by nodes, with the fronts of the multifrontal method (Liu,
// The multifrontal method for sparse matrix solution, 1992). A front eliminates some nodes. Its
// boundary is the set of nodes eliminated later on which this has an effect; the front passes their
// update matrix to its parent.

#include "cholesky/block_graph.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::cholesky {

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

/// Builds the tree for nodes that are eliminated in this order. The order is changed only so that
/// children come right before their parents, which keeps the fill. Nodes in one boundary keep their
/// order. Fronts that share most of their boundary are merged: this adds a few zeros, but larger
/// fronts are faster. \pre `order` holds the nodes with free axes, each once
FrontTree front_tree(const BlockGraph& graph, std::span<const std::uint32_t> order);

} // namespace gewebe::cholesky
