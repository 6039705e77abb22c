#pragma once
// CHOLMOD beside our factor, for the benchmarks.

#include "linalg/factor.h"
#include "linalg/stiffness.h"

#include <cholmod.h>

#include <cstddef>
#include <cstring>
#include <vector>

namespace gewebe::timing {

/// Floating-point operations of a front.
inline double operations(double columns, double below) {
  return columns * columns * columns / 3 + columns * columns * below + columns * below * below;
}

/// Of the whole factor.
inline double all_operations(const linalg::Factor& factor) {
  const linalg::FactorView l = factor.view();
  double all = 0;
  for (std::size_t f = 0; f + 1 < l.super.size(); ++f) {
    const auto columns = static_cast<double>(l.super[f + 1] - l.super[f]);
    all += operations(columns, static_cast<double>(l.pi[f + 1] - l.pi[f]) - columns);
  }
  return all;
}

/// The factor of a matrix by CHOLMOD.
class CholmodPeer {
public:
  /// \param best its order by AMD and by METIS, whichever fills less; else as it would choose
  explicit CholmodPeer(const linalg::StiffnessMatrix& matrix, bool best = false) {
    (void)cholmod_l_start(&common_);
    common_.print = 0;
    common_.supernodal = CHOLMOD_SUPERNODAL;
    if (best) {
      common_.nmethods = 2;
      common_.method[0].ordering = CHOLMOD_AMD;
      common_.method[1].ordering = CHOLMOD_METIS;
    }
    matrix_ = cholmod_l_allocate_sparse(matrix.order(), matrix.order(), matrix.row.size(), 1, 1, -1,
                                        CHOLMOD_REAL, &common_);
    std::memcpy(matrix_->p, matrix.column_start.data(), 8 * matrix.column_start.size());
    std::memcpy(matrix_->i, matrix.row.data(), 8 * matrix.row.size());
    std::memcpy(matrix_->x, matrix.value.data(), 8 * matrix.value.size());
  }
  CholmodPeer(const CholmodPeer&) = delete;
  CholmodPeer& operator=(const CholmodPeer&) = delete;
  ~CholmodPeer() {
    (void)cholmod_l_free_sparse(&matrix_, &common_);
    (void)cholmod_l_free_factor(&factor_, &common_);
    (void)cholmod_l_finish(&common_);
  }
  void order() {
    (void)cholmod_l_free_factor(&factor_, &common_);
    factor_ = cholmod_l_analyze(matrix_, &common_);
  }
  void factorise() { (void)cholmod_l_factorize(matrix_, factor_, &common_); }
  double entries() const { return static_cast<double>(factor_->xsize); }
  double operations() const { return common_.fl; }

  /// The solutions go to `to`, where it is given.
  void solve(const std::vector<double>& f, std::size_t count, double* to = nullptr) {
    cholmod_dense* from = cholmod_l_zeros(factor_->n, count, CHOLMOD_REAL, &common_);
    std::memcpy(from->x, f.data(), 8 * factor_->n * count);
    cholmod_dense* u = cholmod_l_solve(CHOLMOD_A, factor_, from, &common_);
    if (to != nullptr)
      std::memcpy(to, u->x, 8 * factor_->n * count);
    (void)cholmod_l_free_dense(&u, &common_);
    (void)cholmod_l_free_dense(&from, &common_);
  }

private:
  cholmod_common common_{};
  cholmod_sparse* matrix_ = nullptr;
  cholmod_factor* factor_ = nullptr;
};

} // namespace gewebe::timing
