#pragma once
// Columns of the compliance matrix C = K⁻¹ for chosen nodes: what the whole object does when one of
// them is pulled.

#include "base/columns.h"
#include "base/context.h"
#include "solve/factor.h"
#include "solve/stiffness.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe {

/// So many nodes, one behind the other from the first one on, are solved and checked together.
inline constexpr std::size_t compliance_block = Factor::max_units / 3;

/// Solves for the columns of `nodes` in blocks, in parallel, and hands them to `sink` in the order
/// of `nodes` while later ones are being computed. The same bytes for any number of threads. Memory
/// is bounded by the number of threads, not by that of nodes.
///
/// They have rows for the first `row_nodes` nodes, or all if there are fewer; what is solved for
/// and checked is whole.
///
/// `norm` is ‖K‖₁. Of each block of columns a sum with different weights is put back into K u = f.
/// Returns the largest backward error of these.
/// \pre nodes < n, ascending; the factor is of this matrix
/// \throw Error if that exceeds max_backward_error, if memory exceeds the context's, what the sink
/// throws; Cancelled
double compliance_columns(const StiffnessMatrix& matrix, const Factor& factor, double norm,
                          std::span<const std::uint32_t> nodes, const Context& context,
                          ColumnSink& sink, std::size_t row_nodes = SIZE_MAX);

/// Bytes that it takes beside matrix and factor.
double compliance_columns_bytes(const StiffnessMatrix& matrix, std::size_t nodes,
                                const Context& context, std::size_t row_nodes = SIZE_MAX);

} // namespace gewebe
