#pragma once
// Cholesky factor of the compliance among a changing set of displaced nodes, C_cc = L Lᵀ. A node
// that joins appends its rows. A node that leaves needs a rank-3 update of all later rows (Golub &
// Van Loan, Matrix Computations, 6.5).

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace gewebe::compliance {

class ContactBlock {
public:
  std::size_t size() const noexcept { return size_; }

  /// Appends one row of the matrix: its entries with the present rows, then its diagonal.
  /// \return false, and nothing is changed, if the matrix would not be positive definite
  /// \pre added.size() == size() + 1
  bool append(std::span<const double> added);

  /// Removes the rows and columns [first, first + count).
  void remove(std::size_t first, std::size_t count);

  void clear();

  /// Entry of C_cc as it was appended. \pre i, j < size()
  double entry(std::size_t i, std::size_t j) const {
    return i < j ? matrix_[j * (j + 1) / 2 + i] : matrix_[i * (i + 1) / 2 + j];
  }

  /// x = C_cc⁻¹ x. \pre x.size() == size()
  void solve(std::span<double> x) const;
  /// y = C_cc x. \pre x.size() == y.size() == size()
  void multiply(std::span<const double> x, std::span<double> y) const;

private:
  double* row(std::size_t i) { return values_.data() + i * (i + 1) / 2; }
  const double* row(std::size_t i) const { return values_.data() + i * (i + 1) / 2; }
  std::size_t size_ = 0;
  std::vector<double> values_, matrix_; ///< L and C_cc by rows, their lower triangles alone
};

} // namespace gewebe::compliance
