#pragma once
// Cholesky factorisation of symmetric matrices of dense blocks, by the kernels of sparse factors
// (cholesky/multifrontal.h): the same bits on any processor.

#include "base/cpu.h"
#include "cholesky/front_layout.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::cholesky {

/// A symmetric matrix whose unknowns are in groups, where a block of two groups is dense or 0, and
/// its multifrontal factor. Only blocks that are not 0 after the elimination take memory. Groups
/// are eliminated in the order of minimum degree, so the cost of a chain of groups is linear in its
/// length, and that of a single group is that of a dense matrix.
class BlockCholesky {
public:
  /// Begins a matrix: 0. Memory of the last one is used again.
  /// \param group  of each unknown \param coupled  row-major table of groups: not 0 where their
  /// block isn't, symmetric
  /// \pre groups are numbered below the root of coupled.size()
  void begin(std::span<const std::uint32_t> group, std::span<const std::uint8_t> coupled);
  /// Entry of two unknowns, in either order. \pre their groups are coupled, or one
  double& entry(std::uint32_t u, std::uint32_t v) {
    std::uint32_t front = front_of_[group_[u]];
    if (const std::uint32_t other = front_of_[group_[v]];
        other < front || (other == front && local_[v] < local_[u])) {
      std::swap(u, v);
      front = other;
    }
    return column(fronts_[front], local_[u])[row_of(front, group_[v]) + local_[v]];
  }
  /// Adds a symmetric matrix to the entries of these unknowns.
  /// \param block  of order unknowns.size() \pre as for each two of them by entry()
  void add_block(std::span<const std::uint32_t> unknowns, std::span<const double> block);
  /// Factors the matrix in its place. \return whether it is positive definite; if not, solve() must
  /// not be called
  bool factor(CpuLevel cpu);
  /// x = A^-1 x, in place. \param x  vectors, one behind the other \pre factor() returned true
  void solve(std::span<double> x);

private:
  struct Front {
    std::size_t columns = 0;
    std::vector<std::uint32_t> groups; ///< its own, then coupled ones in the order of elimination
    std::vector<std::uint32_t> rows;   ///< their unknowns
    std::vector<double> l;
  };
  static double* column(Front& front, std::size_t c) {
    return front_column(front.l.data(), front.rows.size(), c);
  }
  /// First row of a group in a front.
  std::size_t& row_of(std::size_t front, std::uint32_t group) {
    return row_of_[front * front_of_.size() + group];
  }
  void order_groups(std::span<const std::uint8_t> coupled);
  void add_update(std::size_t from, std::span<double> update);

  std::vector<std::uint32_t> group_, local_;         ///< of each unknown, and its place there
  std::vector<std::vector<std::uint32_t>> unknowns_; ///< by group
  std::vector<std::uint32_t> front_of_;              ///< by group
  std::vector<std::size_t> row_of_;                  ///< by front and group
  std::size_t used_ = 0;                             ///< of the fronts, which keep their memory
  std::vector<Front> fronts_;
  std::vector<double> update_, square_, strips_, least_, part_;
};

/// The inverse of such a matrix in its place, both triangles.
/// \return whether it is positive definite; if not, the matrix is as it was
bool invert(std::span<double> matrix, std::size_t order, CpuLevel cpu);

} // namespace gewebe::cholesky
