#pragma once
// Rounds of a step of integrator/solid_motion.h, each downhill.

#include "base/context.h"
#include "integrator/motion_objective_internal.h"
#include "integrator/motion_quick_internal.h"
#include "integrator/motion_tangent_internal.h"

namespace gewebe::integrator {

/// From `now`, evaluated with turns, until the last round's change is within the tolerance, the
/// rounds have run out or nothing is to be gained. \pre quick is prepared \throw as Factor;
/// Cancelled
void descend_quickly(const MotionObjective& objective, MotionPoint& now, MotionQuick& quick,
                     const SolidMotionOptions& options, SolidStep& step, const Context& context);
/// The same with a tangent that is computed again as the body moves, until rounding.
void descend_as_reference(const MotionObjective& objective, MotionPoint& now,
                          MotionTangent& tangent, SolidStep& step, const Context& context);

/// Downhill to the shape at rest, by the constant matrix while it serves, then by tangents where
/// the body is; until what is left is within the tolerance, of the displacement from rest.
/// `exact`: the tangent that was made serves on; becomes whether it does at the end.
/// \pre as descend_quickly, of an objective without inertia
void descend_to_rest(const MotionObjective& objective, MotionPoint& now, MotionQuick& quick,
                     MotionTangent& tangent, bool& exact, const SolidMotionOptions& options,
                     SolidStep& step, const Context& context);

/// The same of hyperelastic elements alone, by Newton's method with bubbles and pressures as
/// unknowns of their own (fem/mixed_solid.h), damped by the natural monotonicity test or downhill
/// (Deuflhard, Newton methods for nonlinear problems, 2004, 3.3); each factor serves as long as
/// rounds with it are cheaper than another one. Held axes move to `target` with the rest, and
/// following forces are those of the shape.
/// \param now  becomes the shape; its places alone are read and set
/// \param exact  whether `tangent` was made
void newton_to_rest(const MotionObjective& objective, MotionPoint& now, const Numbers& target,
                    std::span<const FollowingForce> following, MotionQuick& quick,
                    MotionTangent& tangent, bool& exact, const SolidMotionOptions& options,
                    SolidStep& step, const Context& context);

} // namespace gewebe::integrator
