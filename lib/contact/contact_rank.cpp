#include "contact/contact_rank_internal.h"

#include <cmath>

namespace gewebe {

using Eigen::Index, Eigen::Matrix3d, Eigen::MatrixXd, Eigen::VectorXd;

namespace {

constexpr int max_refinements = 6;

} // namespace

std::optional<SharedCompliance> shared_compliance(const MatrixXd& w, Index most, double small) {
  SharedCompliance s{MatrixXd(w.rows(), most), w.diagonal()};
  const double least = small * w.diagonal().maxCoeff();
  for (Index rank = 0;; ++rank) {
    Index pivot = 0;
    const double largest = s.rest.maxCoeff(&pivot);
    if (!(largest > least)) {
      if (!s.l.leftCols(rank).allFinite())
        return std::nullopt;
      s.l.conservativeResize(Eigen::NoChange, rank);
      s.rest = s.rest.cwiseMax(0.0);
      return s;
    }
    if (rank == most)
      return std::nullopt;
    s.l.col(rank) = w.col(pivot);
    s.l.col(rank).noalias() -= s.l.leftCols(rank) * s.l.row(pivot).head(rank).transpose();
    s.l.col(rank) /= std::sqrt(largest);
    s.rest -= s.l.col(rank).cwiseAbs2();
    s.rest[pivot] = 0;
  }
}

SharedSolver::SharedSolver(const SharedCompliance& shared, const MatrixXd& g_w,
                           std::span<const Index> first, std::span<const Index> size,
                           std::span<const Matrix3d> g, std::span<const Matrix3d> d)
    : shared_(shared), g_w_(g_w), size_of_g_w_(g_w.cwiseAbs()), first_(first), size_(size),
      d_(d.begin(), d.end()), inverse_(d.size()), spread_(shared.l.rows(), shared.l.cols()) {
  for (std::size_t i = 0; i < first.size(); ++i) {
    const Index k = first[i], n = size[i];
    Matrix3d own = Matrix3d::Identity();
    own.topLeftCorner(n, n) =
        d[i].topLeftCorner(n, n) +
        g[i].topLeftCorner(n, n) * shared.rest.segment(k, n).asDiagonal().toDenseMatrix();
    inverse_[i] = own.inverse();
    const Matrix3d by = inverse_[i] * g[i];
    spread_.middleRows(k, n).noalias() = by.topLeftCorner(n, n) * shared.l.middleRows(k, n);
  }
  MatrixXd small = MatrixXd::Identity(shared.l.cols(), shared.l.cols());
  small.noalias() += shared.l.transpose() * spread_;
  lu_.compute(small);
}

VectorXd SharedSolver::by_blocks(std::span<const Matrix3d> blocks, const VectorXd& x) const {
  VectorXd y(x.size());
  for (std::size_t i = 0; i < first_.size(); ++i)
    y.segment(first_[i], size_[i]) =
        blocks[i].topLeftCorner(size_[i], size_[i]) * x.segment(first_[i], size_[i]);
  return y;
}

std::optional<VectorXd> SharedSolver::solve(const VectorXd& b, double enough) const {
  VectorXd x = VectorXd::Zero(b.size()), left = b;
  for (int k = 0; k <= max_refinements; ++k) {
    VectorXd step = by_blocks(inverse_, left);
    step -= spread_ * lu_.solve(shared_.l.transpose() * step);
    x += step;
    const VectorXd own = by_blocks(d_, x);
    left = b - g_w_ * x - own;
    if (!left.allFinite())
      break;
    // Rows of contacts that push are many orders smaller than those of others: each by its own.
    const VectorXd size = size_of_g_w_ * x.cwiseAbs() + own.cwiseAbs() + b.cwiseAbs();
    if ((left.array().abs() <= enough * size.array()).all())
      return x;
  }
  return std::nullopt;
}

} // namespace gewebe
