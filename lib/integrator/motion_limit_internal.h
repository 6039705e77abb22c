#pragma once
// The limiter of energy growth of integrator/solid_motion.h.

#include "integrator/motion_body_internal.h"

namespace gewebe::integrator {

/// Lowers speeds such that energy (of motion, `elastic`, and of the load) is `before` at most,
/// `rounding` left aside; those of held axes stay. Lowers first what neither moves nor turns the
/// body as a whole (a held body has no other parts), then what turns it, then the rest.
/// \return whether speeds were lowered
bool limit_energy(const MotionBody& body, MotionState& state, double elastic, double before,
                  double rounding);

} // namespace gewebe::integrator
