#pragma once
// Compliance of many contacts at few nodes: what contacts share. Where a surface is pressed, its
// nodes, edges and triangles are each in contact, and the compliance between all of these has the
// rank of the nodes' own.

#include <Eigen/Core>
#include <Eigen/LU>

#include <optional>
#include <span>
#include <vector>

namespace gewebe {

/// W near L Lᵀ + diag(rest): pivoted Cholesky (Harbrecht, Peters, Schneider, On the low-rank
/// approximation by the pivoted Cholesky decomposition, 2012).
struct SharedCompliance {
  Eigen::MatrixXd l;    ///< n by its rank
  Eigen::VectorXd rest; ///< of the diagonal, >= 0
};

/// What is left is at most `small` of the largest entry. None where the rank exceeds `most`.
/// \pre w finite, symmetric and positive semidefinite
std::optional<SharedCompliance> shared_compliance(const Eigen::MatrixXd& w, Eigen::Index most,
                                                  double small);

/// Solves (G W + D) x = b for G and D with one block on the diagonal for each contact, by the
/// matrix inversion lemma with rows of L alone, then by refinement with the matrix itself.
class SharedSolver {
public:
  /// \param g_w G W; both outlive this \param first rows where blocks begin \param size of blocks,
  /// 1 or 3 \param g, d blocks \pre as many of all
  SharedSolver(const SharedCompliance& shared, const Eigen::MatrixXd& g_w,
               std::span<const Eigen::Index> first, std::span<const Eigen::Index> size,
               std::span<const Eigen::Matrix3d> g, std::span<const Eigen::Matrix3d> d);
  /// \return none where refinement leaves more than `enough` of b
  std::optional<Eigen::VectorXd> solve(const Eigen::VectorXd& b, double enough) const;

private:
  Eigen::VectorXd by_blocks(std::span<const Eigen::Matrix3d> blocks,
                            const Eigen::VectorXd& x) const;

  const SharedCompliance& shared_;
  const Eigen::MatrixXd& g_w_;
  Eigen::MatrixXd size_of_g_w_; ///< of each entry
  std::span<const Eigen::Index> first_, size_;
  std::vector<Eigen::Matrix3d> d_, inverse_; ///< D; (D + G rest)⁻¹
  Eigen::MatrixXd spread_;                   ///< (D + G rest)⁻¹ G L
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;  ///< of 1 + Lᵀ spread
};

} // namespace gewebe
