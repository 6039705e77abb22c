#pragma once
// The order of elimination.

#include "cholesky/block_graph.h"

#include <cstdint>
#include <vector>

namespace gewebe {

/// An order of elimination for the nodes that stand for rows, by CHOLMOD: of nested dissection
/// (METIS) and minimum degree (AMD) the one that fills less. It depends on the graph alone: neither
/// of them calls BLAS. Of several threads that call it, one works and the others wait.
/// \throw Error if the graph is too large, std::bad_alloc
std::vector<std::uint32_t> elimination_order(const BlockGraph& graph);

} // namespace gewebe
