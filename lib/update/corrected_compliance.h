#pragma once
// Columns of the compliance matrix of a cut model, for all nodes that had columns before the cut.
// They are corrected or solved for, whichever is cheaper.

#include "base/context.h"
#include "columns/columns.h"
#include "compliance/axis_solver.h"
#include "linalg/stiffness.h"
#include "update/corrected_columns.h"

#include <cstddef>

namespace gewebe::update {

/// Work and accuracy of corrected_compliance.
struct CorrectedCompliance {
  std::size_t corrected = 0; ///< columns that were corrected; the others were solved for
  double residual = 0;       ///< largest backward error of a block of columns
};

/// Hands the columns of columns.nodes() to `sink` in their order, three per node. If correcting
/// does not pay, they are those of compliance_columns. Otherwise they are corrected in blocks of
/// compliance_block nodes. A weighted sum of each block is put into K u = f, as in
/// compliance_columns. A block is solved for if its backward error exceeds max_backward_error, or,
/// for columns of float32, their precision. Results are the same bytes for any number of threads.
///
/// \param matrix of the cut model, with its factor in `solver`; `norm` is ‖K‖₁
/// \pre the columns are corrected to this model
/// \throw Error if a block that was solved for has a backward error beyond max_backward_error; the
/// exceptions of the columns, the solver and the sink; Cancelled
CorrectedCompliance corrected_compliance(const linalg::StiffnessMatrix& matrix,
                                         const compliance::AxisSolver& solver, double norm,
                                         const CorrectedColumns& columns, const Context& context,
                                         columns::ColumnSink& sink);

} // namespace gewebe::update
