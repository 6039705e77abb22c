#include "statics/bent_compliance_internal.h"

#include <utility>

namespace gewebe {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

BentCompliance::BentCompliance(const Compliance& w, std::vector<Index> rows, MatrixXd h)
    : w_(w), rows_(std::move(rows)), h_(std::move(h)) {
  if (rows_.empty())
    return;
  const MatrixXd some = w_(Eigen::all, rows_);
  spread_ = some * h_;
  const MatrixXd own = spread_(rows_, Eigen::all);
  lu_.compute(MatrixXd::Identity(own.rows(), own.cols()) - own);
}

void BentCompliance::apply(MatrixXd& columns) const {
  if (rows_.empty())
    return;
  const MatrixXd some = columns(rows_, Eigen::all);
  const MatrixXd bent = lu_.solve(some);
  columns += spread_ * bent;
}

VectorXd BentCompliance::turning(const VectorXd& x) const {
  VectorXd all = VectorXd::Zero(x.size());
  if (rows_.empty())
    return all;
  const VectorXd some = x(rows_), forces = h_ * some;
  all(rows_) = forces;
  return all;
}

} // namespace gewebe
