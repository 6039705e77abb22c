#pragma once
// A factor for rounds that correct themselves: entries of 16 bits, sums in single precision, and
// subtrees on several threads. What one right-hand side costs is the memory to read: a quarter of
// that of the factor.
//
// An entry below its panel's square is a whole number times a scale of its column, whose largest
// one is ±32767 of them; squares are inverted, in single precision. Beams of
// integrator/solid_motion.h, rounds a step: 2.68 with entries in single precision as with 16
// bits, 2.65 with 12, 7.3 with 8 (3.8, if each 32 rows of a column have a scale of their own).

#include "base/context.h"
#include "linalg/factor.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::linalg {

/// A front's columns, in panels of eight, the last ones four: of each panel the rows below it,
/// eight at a time, column by column, so that memory is read straight on. What fills them up is 0.
struct SingleFront {
  const std::int16_t* l = nullptr; ///< over its column's scale
  /// Of each panel the inverse of its own square by columns, the same by rows, and the scales of
  /// its columns.
  const float* squares = nullptr;
  std::size_t rows = 0, columns = 0;

  static constexpr std::size_t step = 8; ///< rows
  /// Of a panel that begins with column c.
  std::size_t width(std::size_t c) const noexcept { return columns - c > 4 ? 8 : 4; }
  std::size_t own(std::size_t c) const noexcept { ///< columns that don't fill up
    return columns - c < width(c) ? columns - c : width(c);
  }
  std::size_t steps(std::size_t c) const noexcept { return (rows - c - own(c) + step - 1) / step; }
};

struct SingleKernel;

class SingleFactor {
public:
  /// A copy; what is smaller than single precision holds becomes 0.
  explicit SingleFactor(const Factor& factor);

  std::size_t order() const noexcept { return permutation_.size(); }
  /// x = K⁻¹ x, to the precision above: the solution of a matrix that differs from K by about 1e-5
  /// of its largest entries. The same bytes on any number of threads and CPU level.
  /// \pre x.size() == order(); finite, of a size that single precision holds
  void solve(std::span<double> x, const Context& context);

private:
  /// Fronts that one thread does one after the other: a subtree less the subtrees that others do
  /// before it.
  struct Branch {
    std::vector<std::uint32_t> fronts;   ///< ascending, its root last
    std::vector<std::uint32_t> branches; ///< those that end in it, ascending
    std::vector<float> sums; ///< what they and its fronts contribute to rows from its first one on
  };
  void copy_front(SingleFront& front, const double* l);
  void make_branches();
  void forward(Branch& branch, const SingleKernel& kernel);
  void backward(const Branch& branch, const SingleKernel& kernel);
  std::size_t first(const Branch& branch) const { return first_[branch.fronts.front()]; }
  std::span<const std::uint32_t> rows_below(std::uint32_t front) const {
    return std::span(row_).subspan(start_[front], start_[front + 1] - start_[front]);
  }

  std::vector<std::int16_t> values_;
  std::vector<float> squares_;
  std::vector<SingleFront> fronts_;
  std::vector<std::size_t> first_; ///< own row of each front
  std::vector<std::size_t> start_; ///< of its rows below, in
  std::vector<std::uint32_t> row_;
  std::vector<std::uint32_t> permutation_;
  std::vector<Branch> branches_;
  std::vector<std::vector<std::uint32_t>> levels_; ///< branches that don't wait for each other
  std::vector<float> x_;
};

} // namespace gewebe::linalg
