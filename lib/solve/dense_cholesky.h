#pragma once
// Cholesky factorisation of dense symmetric matrices, by the kernels of sparse factors
// (solve/multifrontal.h): the same bits on any processor.

#include "base/cpu.h"

#include <cstddef>
#include <span>
#include <vector>

namespace gewebe {

class DenseCholesky {
public:
  /// Of a matrix by columns, of which the lower triangle is read.
  /// \return whether it is positive definite; if not, there is nothing to solve with
  /// \pre matrix.size() == order * order
  bool factor(std::span<const double> matrix, std::size_t order, CpuLevel cpu);
  std::size_t order() const noexcept { return order_; }
  /// x = A^-1 x, in place. \pre factor() returned true, x.size() == order()
  void solve(std::span<double> x) const;

private:
  std::size_t order_ = 0;
  std::vector<double> l_, square_, strips_, least_;
};

/// The inverse of such a matrix in its place, both triangles.
/// \return whether it is positive definite; if not, the matrix is as it was
bool invert(std::span<double> matrix, std::size_t order, CpuLevel cpu);

} // namespace gewebe
