#include "statics/bent_compliance_internal.h"

#include "base/cpu.h"
#include "compliance/column_sum.h"
#include "statics/bent_kernel_internal.h"

#include <cstddef>
#include <utility>

namespace gewebe {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

namespace {

bool is_small(Index rows) {
  return static_cast<std::size_t>(rows) < bent_kernel_rows;
}

/// W H, of columns of W alone.
MatrixXd spread_of(const BentCompliance::Compliance& w, const Turning& turning) {
  const auto count = std::ssize(turning.rows);
  // Instruments apart from each other share no rows: most of H is 0.
  if (is_small(count)) {
    MatrixXd all(w.rows(), count);
    bent_kernel(best_cpu_level())
        .spread(w.data(), static_cast<std::size_t>(w.rows()), turning.rows.data(),
                turning.rows.size(), turning.h.data(), all.data());
    return all;
  }
  const ColumnSum<double> sum = column_sum<double>(best_cpu_level());
  MatrixXd all = MatrixXd::Zero(w.rows(), count);
  std::vector<const double*> columns;
  std::vector<double> factors;
  for (Index c = 0; c < count; ++c) {
    columns.clear();
    factors.clear();
    for (Index r = 0; r < count; ++r)
      if (const double factor = turning.h(r, c); factor != 0) {
        columns.push_back(w.col(turning.rows[static_cast<std::size_t>(r)]).data());
        factors.push_back(factor);
      }
    sum(columns.data(), factors.data(), columns.size(), all.col(c).data(), 0,
        static_cast<std::size_t>(w.rows()));
  }
  return all;
}

} // namespace

BentCompliance::BentCompliance(const Compliance& w, Turning turning)
    : w_(w), turning_(std::move(turning)) {
  const std::vector<Index>& rows = turning_.rows;
  if (rows.empty())
    return;
  const auto count = std::ssize(rows);
  others_.reserve(static_cast<std::size_t>(w_.rows() - count));
  for (Index r = 0, next = 0; r < w_.rows(); ++r)
    if (next < count && rows[static_cast<std::size_t>(next)] == r)
      ++next;
    else
      others_.push_back(r);
  lu_ = spread_of(w_, turning_);
  if (others_.empty()) {
    const VectorXd diagonal = VectorXd::Ones(count) - lu_.diagonal();
    lu_ = MatrixXd::Zero(count, count) - lu_; // faster than from 1
    lu_.diagonal() = diagonal;
  } else {
    split();
  }
  if (!is_small(count)) {
    large_.emplace(lu_);
    return;
  }
  swapped_.resize(rows.size());
  bent_kernel(best_cpu_level()).factor(lu_.data(), rows.size(), swapped_.data());
}

/// From W H what to solve, and what to spread.
void BentCompliance::split() {
  const std::vector<Index>& rows = turning_.rows;
  const MatrixXd all = std::exchange(lu_, MatrixXd(std::ssize(rows), std::ssize(rows)));
  spread_.resize(std::ssize(others_), all.cols());
  for (Index c = 0; c < all.cols(); ++c) {
    const double* const from = all.col(c).data();
    double* const own = lu_.col(c).data();
    for (std::size_t r = 0; r < rows.size(); ++r)
      own[r] = (static_cast<Index>(r) == c ? 1.0 : 0.0) - from[rows[r]];
    double* const spread = spread_.col(c).data();
    for (std::size_t r = 0; r < others_.size(); ++r)
      spread[r] = from[others_[r]];
  }
}

void BentCompliance::solve(MatrixXd& columns) const {
  if (large_)
    columns = large_->solve(columns).eval();
  else
    bent_kernel(best_cpu_level())
        .solve(lu_.data(), swapped_.data(), swapped_.size(), columns.data(),
               static_cast<std::size_t>(columns.cols()));
}

void BentCompliance::apply(MatrixXd& columns) const {
  const std::vector<Index>& rows = turning_.rows;
  if (rows.empty())
    return;
  if (others_.empty())
    return solve(columns);
  MatrixXd bent(std::ssize(rows), columns.cols());
  for (Index c = 0; c < columns.cols(); ++c) {
    const double* const from = columns.col(c).data();
    double* const to = bent.col(c).data();
    for (std::size_t r = 0; r < rows.size(); ++r)
      to[r] = from[rows[r]];
  }
  solve(bent);
  MatrixXd spread(spread_.rows(), bent.cols());
  if (large_)
    spread.noalias() = spread_ * bent;
  else
    bent_kernel(best_cpu_level())
        .multiply(spread_.data(), others_.size(), rows.size(), bent.data(),
                  static_cast<std::size_t>(bent.cols()), spread.data());
  for (Index c = 0; c < columns.cols(); ++c) {
    double* const to = columns.col(c).data();
    const double* from = bent.col(c).data();
    for (const Index row : rows)
      to[row] = *from++;
    from = spread.col(c).data();
    for (const Index row : others_)
      to[row] += *from++;
  }
}

VectorXd BentCompliance::turning(const VectorXd& x) const {
  const std::vector<Index>& rows = turning_.rows;
  const Compliance h(turning_.h.data(), turning_.h.rows(), turning_.h.cols());
  if (others_.empty() && !rows.empty())
    return times(h, x);
  VectorXd all = VectorXd::Zero(x.size());
  if (rows.empty())
    return all;
  VectorXd some(std::ssize(rows));
  for (std::size_t r = 0; r < rows.size(); ++r)
    some[static_cast<Index>(r)] = x[rows[r]];
  some = times(h, some);
  for (std::size_t r = 0; r < rows.size(); ++r)
    all[rows[r]] = some[static_cast<Index>(r)];
  return all;
}

VectorXd times(const BentCompliance::Compliance& w, const VectorXd& v) {
  if (!is_small(w.cols()))
    return w * v; // whose sums are of blocks
  VectorXd all(w.rows());
  bent_kernel(best_cpu_level())
      .times(w.data(), static_cast<std::size_t>(w.rows()), static_cast<std::size_t>(w.cols()),
             v.data(), all.data());
  return all;
}

} // namespace gewebe
