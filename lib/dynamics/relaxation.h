#pragma once
// Columns of the compliance by letting the model come to rest (report 3.3.2), as long as one likes
// to wait: what the direct way is measured against.
//
// Each node in turn is pulled along each axis by +f and by -f, from rest, and the elastodynamic
// system (dynamics/elastodynamic.h) is integrated until it stands still; the column is (u₊ -
// u₋)/2f. The difference cancels the quadratic part of the springs' answer; a pull to one side
// alone errs by the strain times the softness of the whole.
//
// Where the model comes to rest depends on neither mass nor damping, so these are chosen so that it
// gets there soon: a node's mass is twice the sum of the stiffness of its springs, springs do not
// damp, and drag damps the slowest mode ω_min critically (Underwood, Dynamic relaxation, 1983).

#include "base/columns.h"
#include "base/context.h"
#include "model/model.h"
#include "solve/factor.h"
#include "solve/stiffness.h"

#include <cstdint>
#include <span>

namespace gewebe {

struct RelaxOptions {
  /// f, 1e-6 N; 0: for each pull what moves the model by at most 1e-4 of the shortest spring, by
  /// the factor: small enough for the cubic part of the springs' answer, large enough for rounding.
  double force = 0;
  /// Rest is where the mean of speeds has stayed below threshold · max|u| · ω_min for a period of
  /// the slowest mode, and at least one step was made.
  double threshold = 5e-6;
  std::uint64_t steps = 0; ///< if not 0: so many for each pull, whatever happens
};

struct RelaxFigures {
  double residual = 0;     ///< largest backward error of the columns in K u = f
  std::uint64_t steps = 0; ///< of all pulls
  std::uint64_t pulls = 0;
};

/// The columns of `nodes`, handed to `sink` in their order; each one's `residual` is its own. The
/// same bytes for any number of threads. The factor serves to find ω_min and f alone.
/// \pre nodes < n, ascending; matrix and factor are of this model;
/// \throw Error if a pull doesn't come to rest within 1,000 periods of the slowest mode or its
/// motion is no longer finite; what the sink throws; Cancelled
RelaxFigures relaxed_columns(const Model& model, const StiffnessMatrix& matrix,
                             const Factor& factor, double norm,
                             std::span<const std::uint32_t> nodes, const RelaxOptions& options,
                             const Context& context, ColumnSink& sink);

} // namespace gewebe
