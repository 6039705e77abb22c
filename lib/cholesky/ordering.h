#pragma once
// Elimination order of a sparse matrix that keeps its Cholesky factor small.

#include "cholesky/block_graph.h"

#include <cstdint>
#include <vector>

namespace gewebe::cholesky {

/// Elimination order of the nodes of a graph, by CHOLMOD. Tries nested dissection (METIS) and
/// minimum degree (AMD), and returns the order with less fill. The order depends on the graph
/// alone, because neither method calls BLAS. Concurrent calls run one after the other.
/// \throw Error if the graph is too large, std::bad_alloc
std::vector<std::uint32_t> elimination_order(const BlockGraph& graph);

} // namespace gewebe::cholesky
