#pragma once
// The limiter of energy growth of solid/solid_motion.h.

#include "solid/motion_body_internal.h"

namespace gewebe {

/// Speeds such that energy (of motion, `elastic`, and of the outer load) is `before` at most,
/// `rounding` left aside; true if they had to be lowered, those of held axes never. Taken first
/// from what neither moves nor turns the body as a whole (a held one has no such parts), then from
/// what turns it, then from the rest: from these two only if `all`.
bool limit_energy(const MotionBody& body, MotionState& state, double elastic, double before,
                  double rounding, bool all);

} // namespace gewebe
