#pragma once
// The compliance of nodes whose forces turn with their places: with H = ∂f/∂x,
// x = (1 - W H)⁻¹ (x_free + W (f - H x_last)). H is of few of the nodes, so that a system of these
// alone is solved.

#include <Eigen/Core>
#include <Eigen/LU>

#include <cstdint>
#include <optional>
#include <vector>

namespace gewebe {

/// How forces turn with places.
struct Turning {
  std::vector<Eigen::Index> rows; ///< on which they do, ascending
  Eigen::MatrixXd h;              ///< H of these rows and columns alone
};

class BentCompliance {
public:
  using Compliance = Eigen::Map<const Eigen::MatrixXd>;

  /// \param w W, which must live   \pre H has as many rows and columns as there are rows
  BentCompliance(const Compliance& w, Turning turning);

  /// (1 - W H)⁻¹ of its columns, in place.
  void apply(Eigen::MatrixXd& columns) const;
  /// H of a vector of all rows.
  Eigen::VectorXd turning(const Eigen::VectorXd& x) const;

private:
  void split();
  void solve(Eigen::MatrixXd& columns) const;

  Compliance w_;
  Turning turning_;
  std::vector<Eigen::Index> others_; ///< rows on which forces do not turn
  Eigen::MatrixXd spread_;           ///< W H there
  Eigen::MatrixXd lu_;               ///< 1 - W H where they turn, factored
  std::vector<std::uint32_t> swapped_;
  std::optional<Eigen::PartialPivLU<Eigen::MatrixXd>> large_; ///< in place of both, of many rows
};

/// W v, for which a v that is 0 costs nothing.
Eigen::VectorXd times(const BentCompliance::Compliance& w, const Eigen::VectorXd& v);

} // namespace gewebe
