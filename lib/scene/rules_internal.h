#pragma once
// Table of changes. Each kind of change has a row with its checks, its effect and its log entry. A
// new kind needs a struct in change.h, a row here, an implementation in the file that the row
// names, and a row of the grammar (formats/scene/scene.cpp).

#include "scene/world_internal.h"

#include <cstddef>
#include <string>

namespace gewebe::scene {

/// Defaults for the row of a kind.
template <class Kind>
struct Plain {
  /// Checks that the change can be accepted, now or for later. It may read models, but changes
  /// nothing else. \throw Error
  static void check(World&, const Kind&) {}
  /// Registers what must exist as soon as the change is accepted. Called again when a change that
  /// was scheduled for later takes effect.
  static void enter(World&, const Kind&) {}
  /// Checks that the change can take effect now. \throw Error
  static void require(World&, const Kind&) {}
  /// Whether `apply` may fail after the checks. It is then rolled back.
  static constexpr bool may_fail = false;
  /// Prepares cuts that this change makes likely, so that the first cut costs no more than others.
  static void announce(World&, const Kind&) {}
  static constexpr bool announces_behind = true; // also after the change has taken effect
  /// Whether a node that has been doubled stands for both copies.
  static constexpr bool copies = true;
};

/// Row of a kind of change.
template <class Kind>
struct Rule;

// changes.cpp
template <>
struct Rule<SetForce> : Plain<SetForce> {
  static void check(World& w, const SetForce& c);
  static void apply(World& w, const SetForce& c);
  static void log(const World& w, const SetForce& c, ChangeRow& row);
  static constexpr bool copies = false; // the copies share the node's force
};
template <>
struct Rule<SetPressure> : Plain<SetPressure> {
  static void check(World& w, const SetPressure& c);
  static void apply(World& w, const SetPressure& c);
  static void log(const World& w, const SetPressure& c, ChangeRow& row);
};
template <>
struct Rule<SetMass> : Plain<SetMass> {
  static void check(World& w, const SetMass& c);
  static constexpr bool may_fail = true;
  static void apply(World& w, const SetMass& c);
  static void log(const World& w, const SetMass& c, ChangeRow& row);
  static constexpr bool copies = false;
};
template <>
struct Rule<SetDisplacement> : Plain<SetDisplacement> {
  static void check(World& w, const SetDisplacement& c);
  static void apply(World& w, const SetDisplacement& c);
  static void log(const World& w, const SetDisplacement& c, ChangeRow& row);
};
template <>
struct Rule<Release> : Plain<Release> {
  static void apply(World& w, const Release& c);
  static void log(const World&, const Release&, ChangeRow& row) { row.what = "release"; }
};
template <>
struct Rule<SetGravity> : Plain<SetGravity> {
  static void apply(World& w, const SetGravity& c);
  static void log(const World& w, const SetGravity& c, ChangeRow& row);
};
template <>
struct Rule<SetTimestep> : Plain<SetTimestep> {
  static void apply(World& w, const SetTimestep& c);
  static void log(const World& w, const SetTimestep& c, ChangeRow& row);
};
template <>
struct Rule<Emit> : Plain<Emit> {
  static void apply(World& w, const Emit& c);
  static void log(const World& w, const Emit& c, ChangeRow& row);
};

// prepare.cpp
template <>
struct Rule<Prepare> : Plain<Prepare> {
  static void check(World& w, const Prepare& c);
  static constexpr bool may_fail = true;
  static void apply(World& w, const Prepare& c);
  static void log(const World&, const Prepare& c, ChangeRow& row);
};

// bodies.cpp
template <>
struct Rule<Attach> : Plain<Attach> {
  static void check(World& w, const Attach& c);
  static void enter(World& w, const Attach& c);
  static constexpr bool may_fail = true;
  static void apply(World& w, const Attach& c);
  static void log(const World& w, const Attach& c, ChangeRow& row);
  static constexpr bool copies = false;
};

// methods.cpp
template <>
struct Rule<SetMethod> : Plain<SetMethod> {
  static constexpr bool may_fail = true;
  static void apply(World& w, const SetMethod& c);
  static void log(const World& w, const SetMethod& c, ChangeRow& row);
};

// statics.cpp
template <>
struct Rule<SetTwoStep> : Plain<SetTwoStep> {
  static void check(World& w, const SetTwoStep& c);
  static void apply(World& w, const SetTwoStep& c);
  static void log(const World& w, const SetTwoStep& c, ChangeRow& row);
};

template <>
struct Rule<SetWarp> : Plain<SetWarp> {
  static void check(World& w, const SetWarp& c);
  static void apply(World& w, const SetWarp& c);
  static void log(const World& w, const SetWarp& c, ChangeRow& row);
};

// instruments.cpp
template <>
struct Rule<SetInstrument> : Plain<SetInstrument> {
  static void check(World& w, const SetInstrument& c);
  static void enter(World& w, const SetInstrument& c);
  static void apply(World& w, const SetInstrument& c);
  static void announce(World& w, const SetInstrument& c);
  static void log(const World& w, const SetInstrument& c, ChangeRow& row);
};
template <>
struct Rule<MoveInstrument> : Plain<MoveInstrument> {
  static void check(World& w, const MoveInstrument& c);
  static void require(World& w, const MoveInstrument& c);
  static void apply(World& w, const MoveInstrument& c);
  static void log(const World& w, const MoveInstrument& c, ChangeRow& row);
};
template <>
struct Rule<SetCoupling> : Plain<SetCoupling> {
  static void require(World& w, const SetCoupling& c);
  static void apply(World& w, const SetCoupling& c);
  static void log(const World& w, const SetCoupling& c, ChangeRow& row);
};
template <>
struct Rule<Grasp> : Plain<Grasp> {
  static void check(World& w, const Grasp& c);
  static void require(World& w, const Grasp& c);
  static constexpr bool may_fail = true;
  static void apply(World& w, const Grasp& c);
  static void log(const World&, const Grasp&, ChangeRow& row) { row.what = "grasp"; }
};
template <>
struct Rule<Withdraw> : Plain<Withdraw> {
  static void require(World& w, const Withdraw& c);
  static void apply(World& w, const Withdraw& c);
  static void log(const World&, const Withdraw&, ChangeRow& row) { row.what = "withdraw"; }
};

// islands.cpp
template <>
struct Rule<SetContact> : Plain<SetContact> {
  static void check(World& w, const SetContact& c);
  static constexpr bool may_fail = true;
  static void apply(World& w, const SetContact& c);
  static void log(const World& w, const SetContact& c, ChangeRow& row);
};

// cuts.cpp
template <>
struct Rule<CutObject> : Plain<CutObject> {
  static constexpr bool may_fail = true;
  static void apply(World& w, const CutObject& c);
  static void announce(World& w, const CutObject& c) { announce_cut(w, c.object); }
  static constexpr bool announces_behind = false;
  static void log(const World& w, const CutObject& c, ChangeRow& row);
};
template <>
struct Rule<SetTear> : Plain<SetTear> {
  static void apply(World& w, const SetTear& c);
  static void announce(World& w, const SetTear& c) { announce_cut(w, c.object); }
  static void log(const World& w, const SetTear& c, ChangeRow& row);
};
template <>
struct Rule<Restore> : Plain<Restore> {
  static constexpr bool may_fail = true;
  static void apply(World& w, const Restore& c);
  static void log(const World&, const Restore&, ChangeRow& row) { row.what = "restore"; }
};

/// Refuses periods that would sooner or later be lost in the rounding of the time. \throw Error
void require_period(double period);

/// Calls `check` and `enter` of the change's row.
void accept(World& w, const Change& change);
/// Calls `announce` of the change's row.
void announce(World& w, const Change& change);
/// Applies a change now. \throw Error if it is not accepted, or can't take effect
void apply(World& w, const Change& change);
/// Log row of a change that has just taken effect.
ChangeRow row_of(const World& w, const Change& change);

} // namespace gewebe::scene
