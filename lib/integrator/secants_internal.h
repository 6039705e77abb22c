#pragma once
// L-BFGS for integrator/solid_motion.h.

#include "integrator/motion_numbers_internal.h"

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

namespace gewebe::integrator {

/// What L-BFGS knows of rounds (Nocedal, Wright, Numerical optimization, 2006, 7.2), in single
/// precision. Products of pairs with each other are kept, so that a direction takes four passes
/// over them and no more (Byrd, Nocedal, Schnabel, Representations of quasi-Newton matrices, 1994).
/// A copy shares the pairs, which are not written again.
class Secants {
public:
  void clear() { count_ = earlier_ = 0; }
  /// Those that there are are of earlier steps from now on.
  void begin_step() { earlier_ = count_; }
  void forget_earlier();
  /// \param moved, turned changes of places and of gradients
  void add(const Numbers& moved, const Numbers& turned, const Context& context);
  /// The direction for a gradient, by `solve` in place.
  template <class Solve>
  void direction(Numbers& gradient, const Solve& solve, const Context& context) const {
    const Parts first = remove(gradient, context);
    solve(gradient);
    restore(first, gradient, context);
  }

private:
  static constexpr std::size_t most = 8;
  using Parts = std::array<double, most>;
  struct Pair {
    std::vector<float> moved, turned; ///< of places, of gradients
    double over = 0;
  };
  Parts remove(Numbers& gradient, const Context& context) const;
  void restore(const Parts& first, Numbers& direction, const Context& context) const;
  void drop(std::size_t oldest);

  std::array<std::shared_ptr<Pair>, most> pairs_; ///< the first `count_`, ascending
  std::array<Parts, most> by_older_{}; ///< of each, products of `turned` with `moved` before it
  std::size_t count_ = 0, earlier_ = 0;
};

} // namespace gewebe::integrator
