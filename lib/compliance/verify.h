#pragma once
// A second opinion on a compliance: by conjugate gradients, which share nothing with the factor.

#include "base/columns.h"
#include "base/context.h"
#include "solve/factor.h"
#include "solve/stiffness.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe {

/// x with K x = f by conjugate gradients with K's diagonal as preconditioner (Hestenes and Stiefel
/// 1952), until the residual that they carry along is below 1e-15 ‖f‖. Returns the number of steps.
/// \pre x.size() == f.size() == matrix.order()
/// \throw Error if 100 order() + 1000 steps don't do, or K proves to be indefinite; Cancelled
std::size_t conjugate_gradients(const StiffnessMatrix& matrix, std::span<const double> f,
                                std::span<double> x, const Context& context);

struct Verification {
  std::size_t columns_read = 0; ///< three for each node; their source compares checksums
  std::size_t recomputed = 0;   ///< columns solved for again
  double difference = 0;        ///< largest of ‖x - x'‖ / ‖x'‖ of these, maximum norms
  double asymmetry = 0;         ///< largest |C_ij - C_ji| / max |C| between stored columns
  double tolerance = 0;         ///< what both may be, with the bound of entries if they have one
};

struct VerifyOptions {
  double condition = 0;    ///< of K
  bool single = false;     ///< columns are stored as float32
  double method_error = 0; ///< what the columns' method may err by, relative
  double bound = 0;        ///< what each entry may be wrong by beside that, mm for 1e-6 N
  std::size_t samples = 3; ///< nodes whose columns are solved for again
};

/// Reads every column that there is, and solves again for one of each of some nodes spread
/// over the stored ones (over all nodes, by the factor, where none are stored). They may differ by
/// what the condition explains: 10 ε cond, ε that of the stored precision, by the error of the
/// method, and by the bound. \throw Error naming the
/// node whose columns differ by more, aren't symmetric, or aren't finite; what the source and
/// conjugate_gradients throw
Verification verify_compliance(const StiffnessMatrix& matrix, const Factor& factor,
                               const ColumnSource* columns, const VerifyOptions& options,
                               const Context& context);

} // namespace gewebe
