#include "statics/bent_compliance_internal.h"

#include "base/cpu.h"
#include "compliance/column_sum.h"

#include <utility>

namespace gewebe {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

BentCompliance::BentCompliance(const Compliance& w, std::vector<Index> rows, MatrixXd h)
    : w_(w), rows_(std::move(rows)), h_(std::move(h)) {
  if (rows_.empty())
    return;
  // Instruments apart from each other share no rows: most of H is 0.
  const ColumnSum<double> sum = column_sum<double>(best_cpu_level());
  MatrixXd spread = MatrixXd::Zero(w_.rows(), h_.cols());
  std::vector<const double*> columns;
  std::vector<double> factors;
  for (Index c = 0; c < h_.cols(); ++c) {
    columns.clear();
    factors.clear();
    for (Index r = 0; r < h_.rows(); ++r)
      if (const double factor = h_(r, c); factor != 0) {
        columns.push_back(w_.col(rows_[static_cast<std::size_t>(r)]).data());
        factors.push_back(factor);
      }
    sum(columns.data(), factors.data(), columns.size(), spread.col(c).data(), 0,
        static_cast<std::size_t>(w_.rows()));
  }
  for (Index r = 0, next = 0; r < w_.rows(); ++r)
    if (next < std::ssize(rows_) && rows_[static_cast<std::size_t>(next)] == r)
      ++next;
    else
      others_.push_back(r);
  MatrixXd own(h_.rows(), h_.cols());
  spread_.resize(std::ssize(others_), h_.cols());
  for (Index c = 0; c < h_.cols(); ++c) {
    const double* const from = spread.col(c).data();
    for (Index r = 0; r < own.rows(); ++r)
      own(r, c) = (r == c ? 1.0 : 0.0) - from[rows_[static_cast<std::size_t>(r)]];
    for (Index r = 0; r < spread_.rows(); ++r)
      spread_(r, c) = from[others_[static_cast<std::size_t>(r)]];
  }
  lu_.compute(own);
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
