#pragma once
// Springs beside the elements of a body that moves (integrator/solid_motion.h).
//
// A spring of length l has the energy k (l - rest)²/2, and takes c (l - l₀)²/(2 h) in a step of h
// that it began with the length l₀: a damper along its axis, so that neither part turns a body that
// turns as a whole.

#include "base/context.h"
#include "base/copy_on_write.h"
#include "integrator/motion_numbers_internal.h"
#include "integrator/solid_motion.h"
#include "linalg/stiffness.h"

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::integrator {

class MotionSprings {
public:
  explicit MotionSprings(std::span<const SolidSpring> springs);

  bool empty() const noexcept { return springs_.empty(); }
  /// The energy of the springs at these places and what their dampers take, 1/h being `per_time`,
  /// or 0 at rest; its negative gradient is added to the forces.
  double evaluate(const Numbers& at, double per_time, std::span<double> forces,
                  const Context& context);
  double elastic() const noexcept { return elastic_; } ///< in the last evaluation
  /// Dampers count from the last evaluation on.
  void keep() { kept_.replace() = lengths_; }
  /// Lengths that dampers count from.
  const CopyOnWrite<Numbers>& kept() const noexcept { return kept_; }
  void restore(CopyOnWrite<Numbers> kept) { kept_ = std::move(kept); }
  /// Dampers count from start + factor (kept() - start). \param start  kept() of an earlier time
  void extend(const CopyOnWrite<Numbers>& start, double factor);

  /// A matrix plus that of the springs with all they have along every axis, whatever their
  /// direction: it bounds their tangent wherever they turn to.
  linalg::StiffnessMatrix with_bound(const linalg::StiffnessMatrix& of_elements,
                                     double per_time) const;
  /// The same with their tangent at these places, where positive.
  linalg::StiffnessMatrix with_tangent(const linalg::StiffnessMatrix& of_elements,
                                       const Numbers& at, double per_time) const;

private:
  std::vector<SolidSpring> springs_;
  std::vector<std::uint32_t> i_, j_; ///< of springs, by columns, whole batches of SpringColumns
  Numbers stiffness_, damping_, rest_, lengths_;
  CopyOnWrite<Numbers> kept_;
  double elastic_ = 0;
};

} // namespace gewebe::integrator
