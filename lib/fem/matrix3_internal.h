#pragma once
// Blocks of fem/element.h as Eigen's matrices.

#include "fem/element.h"

#include <Eigen/Core>

namespace gewebe::fem {

using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

inline Matrix3 matrix(const SolidBlock& block) {
  return Eigen::Map<const Matrix3>(block.data());
}

} // namespace gewebe::fem
