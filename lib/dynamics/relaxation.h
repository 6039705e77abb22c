#pragma once
// Columns of the compliance by dynamic relaxation (report 3.3.2): the reference that the direct
// method is compared with.
//
// Each node in turn is pulled along each axis by +f and by -f, from rest. The elastodynamic system
// (dynamics/elastodynamic.h) is integrated until it comes to rest. The column is (u₊ - u₋)/2f. The
// difference cancels the quadratic part of the springs' response. A pull to one side only has an
// error of the strain times the compliance of the whole.
//
// The rest position depends on neither mass nor damping. These are therefore chosen for fast
// convergence: a node's mass is twice the sum of the stiffness of its springs, springs do not damp,
// and drag damps the slowest mode ω_min critically (Underwood, Dynamic relaxation, 1983).

#include "base/context.h"
#include "columns/columns.h"
#include "linalg/factor.h"
#include "linalg/stiffness.h"
#include "model/model.h"

#include <cstdint>
#include <span>

namespace gewebe::dynamics {

struct RelaxOptions {
  /// f, 1e-6 N; 0: for each pull the force that moves the model by at most 1e-4 of the shortest
  /// spring, computed with the factor. That is small enough for the cubic part of the springs'
  /// response, and large enough for rounding.
  double force = 0;
  /// The model is at rest if the mean of speeds has stayed below threshold · max|u| · ω_min for a
  /// period of the slowest mode, and at least one step was made.
  double threshold = 5e-6;
  std::uint64_t steps = 0; ///< if not 0: fixed number of steps for each pull
};

/// Work and accuracy of a relaxation.
struct RelaxFigures {
  double residual = 0;     ///< largest backward error of the columns in K u = f
  std::uint64_t steps = 0; ///< of all pulls
  std::uint64_t pulls = 0;
};

/// Computes the columns of `nodes` and hands them to `sink` in their order, each with its own
/// `residual`. The columns are the same bytes for any number of threads. The factor is used only to
/// find ω_min and f.
/// \pre nodes < n, ascending; matrix and factor are of this model;
/// \throw Error if a pull doesn't come to rest within 1,000 periods of the slowest mode or its
/// motion is no longer finite; what the sink throws; Cancelled
RelaxFigures relaxed_columns(const model::Model& model, const linalg::StiffnessMatrix& matrix,
                             const linalg::Factor& factor, double norm,
                             std::span<const std::uint32_t> nodes, const RelaxOptions& options,
                             const Context& context, columns::ColumnSink& sink);

} // namespace gewebe::dynamics
