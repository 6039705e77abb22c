#include "statics/bent_compliance_internal.h"

#include <utility>

namespace gewebe {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

BentCompliance::BentCompliance(const Compliance& w, std::vector<Index> rows, MatrixXd h)
    : w_(w), rows_(std::move(rows)), h_(std::move(h)) {
  if (rows_.empty())
    return;
  // Instruments apart from each other share no rows: most of H is 0.
  spread_ = MatrixXd::Zero(w_.rows(), h_.cols());
  for (Index c = 0; c < h_.cols(); ++c)
    for (Index r = 0; r < h_.rows(); ++r)
      if (h_(r, c) != 0)
        spread_.col(c) += h_(r, c) * w_.col(rows_[static_cast<std::size_t>(r)]);
  MatrixXd own = MatrixXd::Identity(h_.rows(), h_.cols());
  own -= spread_(rows_, Eigen::all);
  lu_.compute(own);
  for (Index r = 0, next = 0; r < w_.rows(); ++r)
    if (next < std::ssize(rows_) && rows_[static_cast<std::size_t>(next)] == r)
      ++next;
    else
      others_.push_back(r);
  spread_ = spread_(others_, Eigen::all).eval();
}

void BentCompliance::apply(MatrixXd& columns) const {
  if (rows_.empty())
    return;
  const MatrixXd some = columns(rows_, Eigen::all);
  const MatrixXd bent = lu_.solve(some);
  columns(rows_, Eigen::all) = bent;
  if (!others_.empty())
    columns(others_, Eigen::all) += spread_ * bent;
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
