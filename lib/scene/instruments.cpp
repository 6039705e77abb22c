// Instruments: where they go and what they grasp.

#include "geometry/vector_at.h"
#include "scene/rules_internal.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <span>
#include <utility>

namespace gewebe::scene {

namespace {

/// Of its radius, by which an instrument may be inside: more than its shift (gewebe-contact(7),
/// "Gap").
constexpr double allowed_depth = 1e-3;

void require_single(std::initializer_list<Vec3> all, double radius) {
  for (const Vec3& v : all)
    radius = std::max({radius, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(radius <= largest_number))
    throw Error("an instrument of or at " + text::number_text(radius) +
                " mm, expected numbers within single precision");
}

Instrument& present_instrument(World& w, std::size_t instrument) {
  Instrument& i = w.now.instruments.at(instrument);
  if (!i.present)
    throw Error("the instrument " + i.name +
                " is not in the scene now, expected an instrument command before");
  return i;
}

/// Gives grasped nodes the way of their instrument.
void carry(World& w, const Instrument& instrument) {
  const double now = w.now.clock.time;
  for (const Instrument::Grip& grip : instrument.grips) {
    Object& object = w.now.objects[grip.object];
    contact::Load& load = object.load.write();
    const contact::Carrier by{instrument.way, grip.point, object.model().nodes[grip.node].position};
    const Vec3 to = by.at(instrument.way.end);
    load.displacement[grip.node] = to;
    load.ramp.erase(grip.node);
    if (instrument.way.end > now)
      load.ramp[grip.node] = {by.at(now), to, now, instrument.way.end, by};
    touch(object);
  }
}

/// All that it holds.
void let_go(World& w, std::size_t instrument) {
  std::map<std::size_t, std::vector<std::uint32_t>> held;
  for (const Instrument::Grip& grip : w.now.instruments[instrument].grips)
    held[grip.object].push_back(grip.node);
  w.now.instruments[instrument].grips.clear();
  for (const auto& [object, nodes] : held)
    Rule<Release>::apply(w, {object, nodes});
}

} // namespace

std::size_t instrument_place(const World& w, const std::string& name) noexcept {
  const auto at = std::find_if(w.now.instruments.begin(), w.now.instruments.end(),
                               [&](const Instrument& i) { return i.name == name; });
  return static_cast<std::size_t>(at - w.now.instruments.begin());
}

std::size_t add_instrument(World& w, const std::string& name) {
  const std::size_t place = instrument_place(w, name);
  if (place == w.now.instruments.size())
    w.now.instruments.emplace_back().name = name;
  return place;
}

InstrumentReport report_of(const World& w, std::size_t instrument) {
  const Instrument& i = w.now.instruments.at(instrument);
  InstrumentReport report{.name = i.name,
                          .present = i.present,
                          .shape = i.shape,
                          .pose = i.pose(w.now.clock.time),
                          .force = {},
                          .torque = {}};
  if (!i.present)
    return report;
  if (i.coupled) {
    report.hand = i.way.at(w.now.clock.time).place;
    report.coupling = i.coupled->coupling;
  }
  const auto add = [&](const Vec3& at, const Vec3& force) {
    report.force -= force;
    report.torque -= cross(at - report.pose.place, force);
    ++report.nodes;
  };
  for (const Object& object : w.now.objects)
    for (const contact::NodalContactForce& t : object.shown.contact)
      if (t.instrument == instrument)
        add(object.model().nodes[t.node].position + contact_displacement(object, t.node), t.force);
  for (const Instrument::Grip& grip : i.grips) {
    const std::vector<contact::NodeVector>& forces = *w.now.objects[grip.object].shown.forces;
    const auto f = std::lower_bound(
        forces.begin(), forces.end(), grip.node,
        [](const contact::NodeVector& v, std::uint32_t node) { return v.node < node; });
    if (f != forces.end() && f->node == grip.node)
      add(report.pose(grip.point), f->value);
  }
  return report;
}

namespace {

/// Moves an instrument to its pose from outside of the objects that it would be in. It has stood
/// there since the last step, so that objects that move or deform in this step collide with it. Its
/// previous pose does not matter.
void enter_from_outside(World& w, Instrument& i) {
  const auto number = static_cast<std::size_t>(&i - w.now.instruments.data());
  const double now = w.now.clock.time;
  const contact::PoseWay way = i.way;
  const contact::Pose start = entry_pose(w, i.shape, i.pose(now));
  if (i.coupled) { // its hand draws it back
    i.coupled->place = start.place;
    i.coupled->lag = way.at(now).place - start.place;
    i.changed = true;
    return;
  }
  i.before = start;
  i.changed = true;
  i.way = {start, start, now, now};
  note_poses(w);
  for (std::size_t p = 0; p < w.now.poses.size(); ++p)
    if (number < w.now.poses[p].size())
      w.now.poses[p][number] = p > 0 ? std::optional(start) : std::nullopt;
  i.way = way;
  note_poses(w);
}

/// Whether it is in an object by more than contact allows.
bool stands_inside(World& w, const Instrument& i) {
  contact::InstrumentShape thinner = i.shape;
  thinner.radius *= 1 - allowed_depth;
  const contact::Pose pose = i.pose(w.now.clock.time);
  return entry_pose(w, thinner, pose) != pose;
}

} // namespace

void let_instruments_enter(World& w) {
  for (Instrument& i : w.now.instruments)
    if (i.present && !i.shape.blade && stands_inside(w, i))
      enter_from_outside(w, i);
}

void drop_grips(World& w, std::size_t object, const std::vector<std::uint32_t>& nodes) {
  for (Instrument& i : w.now.instruments) {
    if (i.grips.empty())
      continue;
    const std::size_t dropped = std::erase_if(i.grips, [&](const Instrument::Grip& grip) {
      return grip.object == object &&
             std::find(nodes.begin(), nodes.end(), grip.node) != nodes.end();
    });
    if (dropped > 0 && i.present && stands_inside(w, i))
      enter_from_outside(w, i); // it pushes what it held
  }
}

/// Remembers where the instruments are. Where one jumps behind others that jumped just now, they
/// go together: their ways are one.
void note_poses(World& w, std::optional<std::size_t> jumps) {
  if (w.now.instruments.empty())
    return;
  std::vector<std::optional<contact::Pose>> now; // of those that push
  for (Instrument& i : w.now.instruments) {
    now.push_back(i.present && !i.shape.blade ? std::optional(i.pose(w.now.clock.time))
                                              : std::nullopt);
    if (!i.present || !i.shape.blade)
      continue;
    if (const contact::Pose pose = i.way.at(w.now.clock.time);
        i.path.empty() || i.path.back() != pose)
      i.path.push_back(pose);
  }
  std::vector<std::vector<std::optional<contact::Pose>>>& poses = w.now.poses;
  if (!poses.empty() && poses.back() == now)
    return;
  const std::size_t size = poses.size();
  const auto stood_still = [&](std::size_t k) {
    return k < poses[size - 2].size() && poses[size - 2][k] == poses[size - 1][k];
  };
  if (jumps && w.now.jumped == w.now.clock.time && size > 1 && stood_still(*jumps))
    poses.back() = std::move(now);
  else
    poses.push_back(std::move(now));
  w.now.jumped = jumps ? std::optional(w.now.clock.time) : std::nullopt;
}

/// Whether there are some that push, or have just been.
bool instruments_there(const World& w) {
  return std::any_of(w.now.instruments.begin(), w.now.instruments.end(), [](const Instrument& i) {
    return (i.present && !i.shape.blade) || i.changed;
  });
}

std::optional<contact::Pose> pose_at(const World& w, std::size_t moment, std::size_t instrument) {
  const std::vector<std::optional<contact::Pose>>& all = w.now.poses[moment];
  return instrument < all.size() ? all[instrument] : std::nullopt;
}

// ---- changes

void Rule<SetInstrument>::check(World&, const SetInstrument& c) {
  require_single({c.pose.place, c.shape.axis},
                 c.shape.core ? std::max(c.shape.radius, contact::reach_of(c.shape))
                              : c.shape.radius);
}
void Rule<SetInstrument>::enter(World& w, const SetInstrument& c) {
  if (c.instrument == w.now.instruments.size())
    add_instrument(w, c.name);
}
void Rule<SetInstrument>::apply(World& w, const SetInstrument& c) {
  Instrument& i = w.now.instruments.at(c.instrument);
  let_go(w, c.instrument);
  i.changed = i.changed || !c.shape.blade || (i.present && !i.shape.blade);
  i.present = false;
  note_poses(w);
  i.present = true;
  i.coupled.reset();
  i.path.clear();
  i.shape = c.shape;
  const double now = w.now.clock.time;
  i.before = c.pose;
  i.way = {c.pose, c.pose, now, now};
  if (c.shape.blade)
    note_poses(w);
  else
    enter_from_outside(w, i);
}
void Rule<SetInstrument>::announce(World& w, const SetInstrument& c) {
  if (c.shape.blade)
    for (std::size_t i = 0; i < w.now.objects.size(); ++i)
      announce_cut(w, i);
}
void Rule<SetInstrument>::log(const World&, const SetInstrument& c, ChangeRow& row) {
  row.what = "instrument";
  row.vector = c.pose.place;
  row.value = c.shape.radius;
  row.text = contact::instrument_kind_name(contact::kind_of(c.shape));
  row.instrument.end = c.pose(c.shape.axis);
  row.instrument.turn = c.pose.turn;
}

void Rule<MoveInstrument>::check(World&, const MoveInstrument& c) {
  require_single({c.place}, 0);
}
void Rule<MoveInstrument>::require(World& w, const MoveInstrument& c) {
  (void)present_instrument(w, c.instrument);
}
void Rule<MoveInstrument>::apply(World& w, const MoveInstrument& c) {
  Instrument& i = w.now.instruments[c.instrument];
  const double now = w.now.clock.time;
  const contact::Pose from = i.way.at(now);
  i.way = {from, {c.place, c.turn.value_or(from.turn)}, now, now + c.duration};
  carry(w, i);
  note_poses(w, c.duration > 0 ? std::nullopt : std::optional(c.instrument));
}
void Rule<MoveInstrument>::log(const World& w, const MoveInstrument& c, ChangeRow& row) {
  const Instrument& i = w.now.instruments[c.instrument];
  row.what = "move";
  row.vector = c.place;
  row.duration = c.duration;
  row.instrument.end = i.way.to(i.shape.axis);
  row.instrument.turn = i.way.to.turn;
}

void Rule<SetCoupling>::require(World& w, const SetCoupling& c) {
  const Instrument& i = present_instrument(w, c.instrument);
  if (i.shape.blade)
    throw Error("the instrument " + i.name + " is a blade, expected one that pushes");
  if (c.coupling && !i.grips.empty())
    throw Error("the instrument " + i.name +
                " holds nodes, expected one that holds none to be coupled");
}
void Rule<SetCoupling>::apply(World& w, const SetCoupling& c) {
  Instrument& i = w.now.instruments[c.instrument];
  const contact::Pose hand = i.way.at(w.now.clock.time);
  if (!c.coupling) { // at once to where the hand is
    i.coupled.reset();
  } else if (i.coupled) {
    i.coupled->coupling = *c.coupling;
  } else {
    i.coupled = Instrument::Coupled{*c.coupling, hand.place, {}, {}};
  }
  note_poses(w);
}
void Rule<SetCoupling>::log(const World&, const SetCoupling& c, ChangeRow& row) {
  row.what = "couple";
  if (c.coupling) {
    row.value = c.coupling->stiffness;
    row.text = "damping " + text::number_text(c.coupling->damping);
  } else {
    row.text = "off";
  }
}

void Rule<Grasp>::check(World& w, const Grasp& c) {
  Object& object = w.now.objects.at(c.object);
  need_model(object);
  for (const std::uint32_t node : c.nodes)
    if (object.model().nodes[node].fixed != model::fixed_none)
      throw Error("node " + std::to_string(node) +
                  " is fixed, expected nodes that can follow an instrument");
}
void Rule<Grasp>::require(World& w, const Grasp& c) {
  const Instrument& i = present_instrument(w, c.instrument);
  if (i.shape.blade)
    throw Error("the instrument " + i.name + " is a blade, expected one that can hold nodes");
  if (i.coupled)
    throw Error("the instrument " + i.name +
                " is led through a coupling, expected one that holds nodes where it is led: "
                "couple " +
                i.name + " off");
}
void Rule<Grasp>::apply(World& w, const Grasp& c) {
  Instrument& i = w.now.instruments[c.instrument];
  Object& object = w.now.objects.at(c.object);
  shape_in_step(w, object); // where the nodes stand
  const bool inside = 3 * std::size_t{c.nodes.empty() ? 0 : std::ranges::max(c.nodes)} >=
                      object.shown.displacement->size();
  const std::span<const double> shape =
      inside ? whole_shape(w, object) : *object.shown.displacement;
  drop_grips(w, c.object, c.nodes);
  const contact::Pose pose = i.way.at(w.now.clock.time);
  contact::Load& load = object.load.write();
  for (const std::uint32_t node : c.nodes) {
    const Vec3 u =
        object.body != nullptr ? motion_of(object)[node].displacement : vector_at(shape, node);
    i.grips.push_back({c.object, node, pose.inverse(object.model().nodes[node].position + u)});
    load.displacement[node] = u;
    load.ramp.erase(node);
  }
  touch(object);
  if (w.now.clock.time < i.way.end)
    carry(w, i);
  note_poses(w);
}

void Rule<Withdraw>::require(World& w, const Withdraw& c) {
  (void)present_instrument(w, c.instrument);
}
void Rule<Withdraw>::apply(World& w, const Withdraw& c) {
  Instrument& i = w.now.instruments[c.instrument];
  let_go(w, c.instrument);
  i.present = false;
  i.changed = i.changed || !i.shape.blade;
  note_poses(w);
}

} // namespace gewebe::scene
