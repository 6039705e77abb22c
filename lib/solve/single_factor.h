#pragma once
// A factor in single precision, for rounds that correct themselves: half the memory to read, which
// is what one right-hand side costs, and subtrees on several threads.

#include "base/context.h"
#include "solve/factor.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// A front's columns, one behind the other, `rows` numbers each, its own rows first.
struct SingleFront {
  const float* l = nullptr;
  std::size_t rows = 0, columns = 0;
};

struct SingleKernel;

class SingleFactor {
public:
  /// A copy; what is smaller than single precision holds becomes 0.
  explicit SingleFactor(const Factor& factor);

  std::size_t order() const noexcept { return permutation_.size(); }
  /// x = K⁻¹ x, to single precision. The same bytes on any number of threads and CPU level.
  /// \pre x.size() == order(); finite, of a size that single precision holds
  void solve(std::span<double> x, const Context& context);

private:
  struct Subtree {
    std::vector<std::uint32_t> fronts; ///< ascending
    std::size_t first = 0;             ///< its first row
    std::vector<float> sums;           ///< what its fronts contribute to rows from there on
  };
  void gather(std::uint32_t front, const Subtree& tree);
  void forward(std::uint32_t front, const SingleKernel& kernel, float* sums,
               std::vector<float>& below);
  void backward(std::uint32_t front, const SingleKernel& kernel, std::vector<float>& below);

  std::vector<float> values_;
  std::vector<SingleFront> fronts_;
  std::vector<std::size_t> first_; ///< own row of each front
  std::vector<std::size_t> start_; ///< of its rows below, in
  std::vector<std::uint32_t> row_;
  std::vector<std::uint32_t> permutation_;
  std::vector<Subtree> subtrees_;
  std::vector<std::uint32_t> above_; ///< fronts in no subtree, ascending
  std::vector<float> x_;
};

} // namespace gewebe
