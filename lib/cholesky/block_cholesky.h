#pragma once
// Cholesky factorisation of symmetric matrices of dense blocks, by the kernels of sparse factors
// (cholesky/multifrontal.h): the same bits on any processor.

#include "base/cpu.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::cholesky {

/// Multifrontal factor of a matrix whose unknowns are in groups: a block of two groups is dense or
/// 0. Groups are eliminated in the order of minimum degree. So the cost of a chain of groups is
/// linear in its length, and that of a single group is that of a dense matrix.
class BlockCholesky {
public:
  /// \param matrix by columns; its lower triangle is read; overwritten
  /// \param group  of each unknown \param coupled  row-major table of groups: not 0 where their
  /// block isn't, symmetric
  /// \return whether the matrix is positive definite; if not, solve() must not be called
  /// \pre matrix.size() == group.size()^2; groups are numbered below the root of coupled.size()
  bool factor(std::span<double> matrix, std::span<const std::uint32_t> group,
              std::span<const std::uint8_t> coupled, CpuLevel cpu);
  /// x = A^-1 x, in place. \pre factor() returned true, x.size() == group.size()
  void solve(std::span<double> x);

private:
  struct Front {
    std::size_t columns = 0;
    std::vector<std::uint32_t> rows; ///< unknowns, those of the group first
    std::vector<double> l;
  };
  void order_groups(std::span<const std::uint32_t> group, std::span<const std::uint8_t> coupled);

  std::size_t order_ = 0, used_ = 0; ///< of the fronts, which keep their memory
  std::vector<Front> fronts_;
  std::vector<double> update_, square_, strips_, least_, part_;
};

/// The inverse of such a matrix in its place, both triangles.
/// \return whether it is positive definite; if not, the matrix is as it was
bool invert(std::span<double> matrix, std::size_t order, CpuLevel cpu);

} // namespace gewebe::cholesky
