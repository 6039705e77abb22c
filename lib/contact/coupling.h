#pragma once
// Virtual coupling: a hand leads an instrument through a spring and a damper, so that what the hand
// feels is never stiffer than the spring, whatever is touched (J. Colgate, M. Stanley, J. Brown,
// Issues in the haptic display of tool use, 1995). The instrument has no mass: at each end of a
// step the coupling's force and those of what it touches are in balance,
//
//   K e + D (e - e_before)/h + F = 0, e = hand - instrument,
//
// (backward Euler, which takes from the hand what damper and spring lose and never gives more).
// The instrument's position yields to F; its rotation is the hand's.

#include "geometry/vec3.h"

#include <cmath>

namespace gewebe::contact {

struct Coupling {
  double stiffness = 1; ///< K, g/s² (1e-6 N/mm), > 0
  double damping = 0;   ///< D, g/s, >= 0

  bool operator==(const Coupling&) const = default;
};

/// A step of it.
struct CouplingStep {
  double compliance = 0; ///< mm per force at the step's end
  Vec3 free;             ///< e there without a force

  /// \param lag e before \param h its length, s, >= 0: at h = 0 a damper is rigid
  CouplingStep(const Coupling& coupling, const Vec3& lag, double h) {
    const double damper = coupling.damping > 0 ? coupling.damping / h : 0;
    const double all = coupling.stiffness + damper;
    compliance = 1 / all; // 0 where h is 0
    free = std::isfinite(all) ? damper / all * lag : coupling.damping > 0 ? lag : Vec3{};
  }
  /// e under the force F on the instrument (1e-6 N).
  Vec3 lag(const Vec3& force) const { return free - compliance * force; }
};

/// Part of the radius. An instrument that moves no further than this in a step is at rest.
inline constexpr double led_to_rest = 1e-9;

} // namespace gewebe::contact
