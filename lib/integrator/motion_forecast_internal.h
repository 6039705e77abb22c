#pragma once
// Where a step of integrator/solid_motion.h begins to seek.

#include "base/context.h"
#include "base/copy_on_write.h"
#include "integrator/motion_numbers_internal.h"

#include <cstddef>
#include <deque>

namespace gewebe::integrator {

/// Foretells a step's acceleration from those of the last ones, as the sum of three of them that
/// would have foretold the last one best (linear prediction: Makhoul, Linear prediction, Proc. IEEE
/// 63(4), 1975): what swings does so by a recurrence of this kind, also where it decays or turns.
class MotionForecast {
public:
  void clear() { past_.clear(); }
  /// Of a step that was taken. \param masses by node
  void add(Numbers acceleration, const Numbers& masses, const Context& context);
  /// to += factor · the acceleration of the next one; 0 if nothing is known.
  void add_to(Numbers& to, double factor, const Context& context) const;
  /// Nothing is accelerated along this axis.
  void hold(std::size_t axis);

private:
  static constexpr std::size_t terms = 3, most = terms + 2;
  std::array<double, terms> weights() const;

  std::deque<CopyOnWrite<Numbers>> past_;                ///< newest first
  std::array<std::array<double, most>, most> product_{}; ///< of them, by masses
};

} // namespace gewebe::integrator
