#pragma once
// Verification of a compliance by conjugate gradients, which do not use the factor.

#include "base/context.h"
#include "columns/columns.h"
#include "linalg/factor.h"
#include "linalg/stiffness.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe::columns {

/// Solves K x = f by conjugate gradients with K's diagonal as preconditioner (Hestenes and Stiefel
/// 1952), until their recursive residual is below 1e-15 ‖f‖. Returns the number of steps.
/// \pre x.size() == f.size() == matrix.order()
/// \throw Error if 100 order() + 1000 steps don't suffice, or K proves to be indefinite; Cancelled
std::size_t conjugate_gradients(const linalg::StiffnessMatrix& matrix, std::span<const double> f,
                                std::span<double> x, const Context& context);

struct Verification {
  std::size_t columns_read = 0; ///< three for each node; their source checks their checksums
  std::size_t recomputed = 0;   ///< columns solved for again
  double difference = 0;        ///< largest of ‖x - x'‖ / ‖x'‖ of these, maximum norms
  double asymmetry = 0;         ///< largest |C_ij - C_ji| / max |C| between stored columns
  double tolerance = 0;         ///< limit of both, with the error bound of entries if they have one
};

struct VerifyOptions {
  double condition = 0;    ///< of K
  bool single = false;     ///< columns are stored as float32
  double method_error = 0; ///< relative error of the method that made the columns
  double bound = 0;        ///< further error of each entry, mm for 1e-6 N
  std::size_t samples = 3; ///< nodes whose columns are solved for again
};

/// Reads every stored column, and solves again for one column of each of some nodes, spread over
/// those with stored columns. Without stored columns the nodes are spread over all, and the factor
/// gives the columns. The allowed difference is 10 ε cond, with ε of the stored precision, plus the
/// error of the method and the bound.
/// \throw Error with the node whose columns differ by more, aren't symmetric, or aren't finite; as
/// the source and conjugate_gradients
Verification verify_compliance(const linalg::StiffnessMatrix& matrix, const linalg::Factor& factor,
                               const ColumnSource* columns, const VerifyOptions& options,
                               const Context& context);

} // namespace gewebe::columns
