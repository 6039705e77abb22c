#pragma once
// Columns of the compliance matrix C = K⁻¹ for chosen nodes: the displacement of the whole object
// under a unit force at one of them.

#include "base/context.h"
#include "columns/columns.h"
#include "linalg/factor.h"
#include "linalg/stiffness.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe::columns {

/// Number of consecutive nodes that are solved for and checked together.
inline constexpr std::size_t compliance_block = linalg::Factor::max_units / 3;

/// Solves for the columns of `nodes` in blocks, in parallel, and hands them to `sink` in the order
/// of `nodes` while later ones are being computed. Results are the same bytes for any number of
/// threads. Memory grows with the number of threads, not with that of nodes.
///
/// The columns have rows for the first `row_nodes` nodes, or all if there are fewer. Whole columns
/// are solved for and checked.
///
/// `norm` is ‖K‖₁. As a check, a weighted sum of each block of columns, with different weights, is
/// put into K u = f. Returns the largest backward error of these sums.
/// \pre nodes < n, ascending; the factor is of this matrix
/// \throw Error if that error exceeds max_backward_error, or if memory exceeds the context's; the
/// exceptions of the sink; Cancelled
double compliance_columns(const linalg::StiffnessMatrix& matrix, const linalg::Factor& factor,
                          double norm, std::span<const std::uint32_t> nodes, const Context& context,
                          ColumnSink& sink, std::size_t row_nodes = SIZE_MAX);

/// Memory of compliance_columns beside matrix and factor, bytes.
double compliance_columns_bytes(const linalg::StiffnessMatrix& matrix, std::size_t nodes,
                                const Context& context, std::size_t row_nodes = SIZE_MAX);

} // namespace gewebe::columns
