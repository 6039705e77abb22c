#pragma once
// The compliance of nodes whose forces turn with their places: with H = ∂f/∂x,
// x = (1 - W H)⁻¹ (x_free + W (f - H x_last)). H is of few of the nodes, so that a system of these
// alone is solved.

#include <Eigen/Core>
#include <Eigen/LU>

#include <vector>

namespace gewebe {

class BentCompliance {
public:
  using Compliance = Eigen::Map<const Eigen::MatrixXd>;

  /// \param w W, which must live on \param rows on which forces turn, ascending \param h H of these
  /// rows and columns alone   \pre h has as many rows and columns
  BentCompliance(const Compliance& w, std::vector<Eigen::Index> rows, Eigen::MatrixXd h);

  /// (1 - W H)⁻¹ of its columns, in place.
  void apply(Eigen::MatrixXd& columns) const;
  /// H of a vector of all rows.
  Eigen::VectorXd turning(const Eigen::VectorXd& x) const;

private:
  Compliance w_;
  std::vector<Eigen::Index> rows_, others_; ///< on which forces turn, and do not
  Eigen::MatrixXd h_, spread_;              ///< H, and rows of W H on which they don't turn
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
};

} // namespace gewebe
