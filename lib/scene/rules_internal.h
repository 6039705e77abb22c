#pragma once
// The table of changes: for each kind whether it can be accepted, whether it can take effect now,
// what it does, and what a log says of it. A new kind is a struct in change.h, a row here, what it
// does in the file of its duty, and a row of the grammar (formats/scene/scene.cpp).

#include "scene/world_internal.h"

#include <cstddef>
#include <string>

namespace gewebe::simulation {

/// What holds for a kind that says nothing else.
template <class Kind>
struct Plain {
  /// That it can be accepted, now or for later. Nothing is changed by it but what is read.
  /// \throw Error
  static void check(World&, const Kind&) {}
  /// What is known from when it is accepted, be it for later; twice where it was for later.
  static void enter(World&, const Kind&) {}
  /// That it can take effect now. \throw Error
  static void require(World&, const Kind&) {}
  /// Behind the checks it may fail still, and is taken back then.
  static constexpr bool may_fail = false;
  /// It is a moment that instruments' ways go through.
  static constexpr bool is_moment = true;
  /// What it is about will come apart: so that the first cut costs no more than others.
  static void announce(World&, const Kind&) {}
  static constexpr bool announces_behind = true; // when it has taken effect too
  /// Of a node that is doubled, both copies are meant.
  static constexpr bool copies = true;
};

template <class Kind>
struct Rule;

// changes.cpp
template <>
struct Rule<SetForce> : Plain<SetForce> {
  static void check(World& w, const SetForce& c);
  static void apply(World& w, const SetForce& c);
  static void log(const World& w, const SetForce& c, ChangeRow& row);
  static constexpr bool copies = false; // what the node had is shared
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
template <>
struct Rule<Renew> : Plain<Renew> {
  static constexpr bool is_moment = false; // a record has it where nothing took effect
  static void apply(World& w, const Renew& c);
  static void log(const World&, const Renew&, ChangeRow& row) { row.what = "renew"; }
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

/// Shorter ones are lost in the rounding of the time, sooner or later. \throw Error
void require_period(double period);

/// One of the table's functions for a change of any kind.
void accept(World& w, const Change& change); ///< checks, then enters
void announce(World& w, const Change& change);
/// Takes effect now. \throw Error where it is not accepted, or can't
void apply(World& w, const Change& change);
/// What a log says of a change that has just taken effect.
ChangeRow row_of(const World& w, const Change& change);

} // namespace gewebe::simulation
