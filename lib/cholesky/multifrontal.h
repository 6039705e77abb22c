#pragma once
// Multifrontal Cholesky factorisation of a sparse matrix (Liu, The multifrontal method for sparse
// matrix solution: theory and practice, 1992). A front assembles its rows of the matrix, adds the
// update matrices of its children (extend-add), eliminates its columns, and passes an update matrix
// to its parent. The same bits on any number of threads and any CPU level.

#include "base/context.h"
#include "cholesky/front_layout.h"
#include "cholesky/front_tree.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace gewebe::cholesky {

/// Memory for numbers of a front.
class FrontMemory {
public:
  /// Returns memory for `size` numbers, uninitialised. Memory that is large enough is used again.
  /// `again`: the front may be computed again, so some more is allocated, for copies of nodes.
  double* reserve(std::size_t size, bool again);
  void release() noexcept;
  double* data() noexcept { return data_.get(); }
  const double* data() const noexcept { return data_.get(); }

private:
  std::unique_ptr<double[]> data_;
  std::size_t capacity_ = 0;
};

struct Front {
  std::size_t rows = 0, columns = 0;
  double* l = nullptr;      ///< see front_offset
  double* update = nullptr; ///< what it leaves to its parent: a lower triangle, packed by columns
  FrontMemory kept;         ///< where that is, if it isn't on a stack
  double weakest = std::numeric_limits<double>::infinity(); ///< pivot over what it had to exceed
  std::size_t weakest_column = 0;

  std::size_t below() const noexcept { return rows - columns; }
  std::size_t entries() const noexcept { return front_offset(rows, columns); }
};

/// What a front's matrix is made of: its part of K is added to `l`, which is 0.
struct FrontAssembly {
  std::size_t front = 0;
  std::span<const std::uint32_t> row; ///< by node, those of this front: where its rows begin
  std::size_t rows = 0;               ///< of the front
  double* l = nullptr;
  std::vector<double>& min_pivot; ///< of each column what its pivot must exceed; 0 if left alone

  /// \pre row >= column
  double& at(std::size_t r, std::size_t c) const { return front_column(l, rows, c)[r]; }
};

/// Thrown where a pivot is too small.
struct PivotTooSmall {
  std::size_t front, column;
};

struct Multifrontal {
  const FrontTree& tree;
  std::span<const std::uint8_t> axes;                 ///< by node
  std::span<Front> fronts;                            ///< of the tree, with room for L
  std::function<void(const FrontAssembly&)> assemble; ///< called from several threads
  bool keep_updates = false; ///< update matrices stay, so that some fronts can be computed again
};

/// What a factorisation did.
struct FrontalWork {
  std::size_t fronts = 0, computed = 0; ///< of how many, how many were computed
  double operations = 0;                ///< floating-point, of those computed
  double all_operations = 0;            ///< of a factorisation of everything
};

/// Sets rows and columns of the fronts. \return the entries of L of all of them, zeros counted
std::size_t measure_fronts(const FrontTree& tree, std::span<const std::uint8_t> axes,
                           std::span<Front> fronts);

/// The blocks of L of all fronts as supernodes (linalg/supernodal_solve_internal.h), one behind the
/// other.
struct FrontBlocks {
  std::vector<std::int64_t> super{0}, pi{0}; ///< where their columns, and rows in s, begin
  std::vector<std::int64_t> s;               ///< rows of L, which are those of tree.sequence
  std::vector<std::uint32_t> first{0};       ///< fronts + 1: blocks of each
  std::size_t longest = 1;                   ///< rows that a block has below its columns
};
/// \pre measure_fronts() has measured the fronts
FrontBlocks front_blocks(const FrontTree& tree, std::span<const std::uint8_t> axes,
                         std::span<const Front> fronts);

/// Bytes that the update matrices need at once, at most, on so many threads.
double update_bytes(const FrontTree& tree, std::span<const Front> fronts, bool keep_updates,
                    int threads);

/// Computes the selected fronts: those f with selected[f] != 0, or all where it is empty. Ancestors
/// of a selected front must be selected too. A small subtree is computed by one thread, the fronts
/// above such subtrees by all threads.
/// \throw PivotTooSmall (of the first front that has one), Cancelled
FrontalWork factorise(const Multifrontal& task, std::span<const char> selected,
                      const Context& context);

} // namespace gewebe::cholesky
