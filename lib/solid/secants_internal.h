#pragma once
// L-BFGS for solid/solid_motion.h.

#include "solid/motion_numbers_internal.h"

#include <array>
#include <cstddef>
#include <deque>
#include <utility>

namespace gewebe {

/// What L-BFGS knows of a step's rounds (Nocedal, Wright, Numerical optimization, 2006, 7.2).
class Secants {
public:
  void clear() { pairs_.clear(); }
  void add(Numbers moved, Numbers turned) {
    const double curvature = product(moved, turned);
    if (!(curvature > 0))
      return;
    if (pairs_.size() == most)
      pairs_.pop_front();
    pairs_.push_back({std::move(moved), std::move(turned), 1 / curvature});
  }
  /// The direction for a gradient, by `solve` in place.
  template <class Solve>
  void direction(Numbers& gradient, const Solve& solve) const {
    std::array<double, most> part{};
    for (std::size_t k = pairs_.size(); k-- > 0;) {
      part[k] = pairs_[k].over * product(pairs_[k].moved, gradient);
      gewebe::add(gradient, -part[k], pairs_[k].turned);
    }
    solve(gradient);
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      gewebe::add(gradient, part[k] - pairs_[k].over * product(pairs_[k].turned, gradient),
                  pairs_[k].moved);
  }

private:
  static constexpr std::size_t most = 8;
  struct Pair {
    Numbers moved, turned; ///< of places, of gradients
    double over;
  };
  std::deque<Pair> pairs_;
};

} // namespace gewebe
