#pragma once
// All columns of the compliance matrix of a cut model that the model before had, corrected or
// solved for, whichever is cheaper.

#include "base/columns.h"
#include "base/context.h"
#include "compliance/axis_solver.h"
#include "cutting/corrected_columns.h"
#include "solve/stiffness.h"

#include <cstddef>

namespace gewebe {

struct CorrectedCompliance {
  std::size_t corrected = 0; ///< columns that were corrected; the others were solved for
  double residual = 0;       ///< largest backward error of a block of columns
};

/// Hands the columns of columns.nodes() to `sink` in their order, three a node. Where correcting
/// does not pay they are compliance_columns. Otherwise they are corrected in blocks of
/// compliance_block nodes, and of each a sum with different weights is put back into K u = f, as
/// compliance_columns does; a block with a backward error beyond max_backward_error, or the
/// precision of float32 where the columns are kept so, is solved for. The same bytes for any number
/// of threads.
///
/// \param matrix of the cut model, with its factor in `solver`; `norm` is ‖K‖₁
/// \pre the columns are corrected to this model
/// \throw Error if a block that was solved for has a backward error beyond max_backward_error, what
/// the columns, the solver and the sink throw; Cancelled
CorrectedCompliance corrected_compliance(const StiffnessMatrix& matrix, const AxisSolver& solver,
                                         double norm, const CorrectedColumns& columns,
                                         const Context& context, ColumnSink& sink);

} // namespace gewebe
