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

/// Columns of a matrix times numbers. Where few of these are not 0, the others cost nothing.
class ColumnsBy {
public:
  explicit ColumnsBy(const BentCompliance::Compliance& w)
      : w_(w), sum_(column_sum<double>(best_cpu_level())) {
    columns_.reserve(static_cast<std::size_t>(w.cols()));
    factors_.reserve(static_cast<std::size_t>(w.cols()));
  }
  void add(Index column, double factor) {
    if (factor == 0)
      return;
    columns_.push_back(w_.col(column).data());
    factors_.push_back(factor);
  }
  /// Adds what was added since the last time.
  void sum(VectorXd& to) {
    sum_(columns_.data(), factors_.data(), columns_.size(), to.data(), 0,
         static_cast<std::size_t>(to.size()));
    columns_.clear();
    factors_.clear();
  }

private:
  const BentCompliance::Compliance& w_;
  ColumnSum<double> sum_;
  std::vector<const double*> columns_;
  std::vector<double> factors_;
};

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
  lu_.resize(count, count);
  spread_.resize(std::ssize(others_), count);
  // Instruments apart from each other share no rows: most of H is 0.
  ColumnsBy columns(w_);
  VectorXd sum(w_.rows());
  for (Index c = 0; c < count; ++c) {
    const double* const by = turning_.h.col(c).data();
    for (Index r = 0; r < count; ++r)
      columns.add(rows[static_cast<std::size_t>(r)], by[r]);
    sum.setZero();
    columns.sum(sum);
    double* const own = lu_.col(c).data();
    for (Index r = 0; r < count; ++r)
      own[r] = (r == c ? 1.0 : 0.0) - sum[rows[static_cast<std::size_t>(r)]];
    double* const spread = spread_.col(c).data();
    for (Index r = 0; r < spread_.rows(); ++r)
      spread[r] = sum[others_[static_cast<std::size_t>(r)]];
  }
  if (!is_small(count)) {
    large_.emplace(lu_);
    return;
  }
  swapped_.resize(rows.size());
  bent_kernel(best_cpu_level()).factor(lu_.data(), rows.size(), swapped_.data());
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
  for (Index c = 0; c < columns.cols(); ++c)
    for (Index r = 0; r < bent.rows(); ++r)
      bent(r, c) = columns(rows[static_cast<std::size_t>(r)], c);
  solve(bent);
  MatrixXd spread(spread_.rows(), bent.cols());
  if (large_)
    spread = spread_ * bent;
  else
    bent_kernel(best_cpu_level())
        .multiply(spread_.data(), others_.size(), rows.size(), bent.data(),
                  static_cast<std::size_t>(bent.cols()), spread.data());
  for (Index c = 0; c < columns.cols(); ++c) {
    for (Index r = 0; r < bent.rows(); ++r)
      columns(rows[static_cast<std::size_t>(r)], c) = bent(r, c);
    for (Index r = 0; r < spread.rows(); ++r)
      columns(others_[static_cast<std::size_t>(r)], c) += spread(r, c);
  }
}

VectorXd BentCompliance::turning(const VectorXd& x) const {
  const std::vector<Index>& rows = turning_.rows;
  VectorXd all = VectorXd::Zero(x.size());
  if (rows.empty())
    return all;
  const Compliance h(turning_.h.data(), turning_.h.rows(), turning_.h.cols());
  const VectorXd some = x(rows), forces = times(h, some);
  all(rows) = forces;
  return all;
}

VectorXd times(const BentCompliance::Compliance& w, const VectorXd& v) {
  if (!is_small(w.cols()))
    return w * v; // whose sums are of blocks
  ColumnsBy columns(w);
  for (Index c = 0; c < w.cols(); ++c)
    columns.add(c, v[c]);
  VectorXd all = VectorXd::Zero(w.rows());
  columns.sum(all);
  return all;
}

} // namespace gewebe
