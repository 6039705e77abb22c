#pragma once
// Rounds of a step of integrator/solid_motion.h, each downhill.

#include "base/context.h"
#include "integrator/motion_objective_internal.h"
#include "integrator/motion_quick_internal.h"
#include "integrator/motion_tangent_internal.h"

namespace gewebe {

/// From `now`, evaluated with turns, until the last round's change is within the tolerance, the
/// rounds have run out or nothing is to be gained. \pre quick is prepared \throw as Factor;
/// Cancelled
void descend_quickly(const MotionObjective& objective, MotionPoint& now, MotionQuick& quick,
                     const SolidMotionOptions& options, SolidStep& step, const Context& context);
/// The same with a tangent, anew as the body moves, until rounding.
void descend_as_reference(const MotionObjective& objective, MotionPoint& now,
                          MotionTangent& tangent, SolidStep& step, const Context& context);

} // namespace gewebe
