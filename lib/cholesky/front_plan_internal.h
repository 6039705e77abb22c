#pragma once
// Which fronts are computed where, and where what they leave to their parents stands meanwhile.

#include "cholesky/front_tree.h"
#include "cholesky/multifrontal.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::cholesky {

/// Floating-point operations of a front.
double front_operations(const Front& front);

/// Numbers of a lower triangle, packed by columns.
inline std::size_t packed_triangle(std::size_t rows) {
  return rows * (rows + 1) / 2;
}

struct FrontPlan {
  /// Ranges, each by one thread; those of most work first, so that the last ones are short.
  std::vector<std::pair<std::size_t, std::size_t>> subtrees;
  std::vector<std::size_t> above; ///< by all threads, ascending
  /// By front: where its update matrix stands until the parent has taken it: on one of two stacks,
  /// or in memory of its own. A front that is computed takes its children from one stack, where
  /// they are the last, and puts its own on the other.
  std::vector<std::uint8_t> place;
  static constexpr std::uint8_t own = 2;
  std::vector<std::vector<std::uint32_t>> children; ///< of each front
};

/// \param under operations in the subtree of each front, `all` of them
FrontPlan front_plan(const FrontTree& tree, std::span<const double> under, double all, int threads,
                     bool keep_updates);

/// Two stacks of update matrices, of some fronts that are computed one after the other.
class UpdateStacks {
public:
  /// Counts how much memory a stack needs, without allocating it.
  struct Size {
    std::array<std::size_t, 2> now{}, peak{};

    void push(std::uint8_t stack, std::size_t below);
    void pop(std::uint8_t stack, std::size_t below);
    /// Adds the computation of front f, in the order of the calls.
    void compute(const FrontPlan& plan, std::span<const Front> fronts, std::size_t f);
    std::size_t numbers() const { return peak[0] + peak[1]; }
  };

  void prepare(const Size& size);
  double* push(std::uint8_t stack, std::size_t below);
  void pop(std::uint8_t stack, std::size_t below);

private:
  std::array<FrontMemory, 2> memory_;
  Size size_;
};

} // namespace gewebe::cholesky
