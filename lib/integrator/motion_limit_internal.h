#pragma once
// The limiter of energy growth of integrator/solid_motion.h.

#include "integrator/motion_body_internal.h"

namespace gewebe::integrator {

/// Of the speeds that neither move nor turn the body as a whole; of a held body, of all of axes
/// that are not held.
double inner_energy(const MotionBody& body, const MotionState& state);
/// Multiplies these speeds.
void slow_inner(const MotionBody& body, MotionState& state, double factor);

/// Lowers speeds such that energy (of motion, `elastic`, and of the load) is `before` at most,
/// `rounding` left aside; those of held axes stay. Lowers first what neither moves nor turns the
/// body as a whole (a held body has no other parts), then what turns it, then the rest.
/// \return whether speeds were lowered
bool limit_energy(const MotionBody& body, MotionState& state, double elastic, double before,
                  double rounding);

} // namespace gewebe::integrator
