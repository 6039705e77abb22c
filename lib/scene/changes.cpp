// Changes: from the table to one of them, and those of loads and of the scene as a whole.

#include "scene/rules_internal.h"

#include <cmath>
#include <variant>

namespace gewebe::scene {

namespace {

/// Fills the columns of a log row that follow from the names of a change's fields.
template <class Kind>
void log_names(const World& w, const Kind& c, ChangeRow& row) {
  if constexpr (requires { c.object; })
    row.object = w.now.objects.at(c.object).name();
  if constexpr (requires { c.nodes; })
    row.nodes = c.nodes;
  if constexpr (requires { c.instrument; })
    (requires { c.object; } ? row.other : row.object) = w.now.instruments.at(c.instrument).name;
  if constexpr (requires { c.others; }) {
    row.other = w.now.objects.at(c.other).name();
    row.others = c.others;
  }
}

void displace(const World& w, Object& object, const SetDisplacement& set) {
  contact::Load& load = object.load.write();
  for (const std::uint32_t node : set.nodes) {
    Vec3 from;
    if (object.body != nullptr)
      from = motion_of(object)[node].displacement;
    else if (const auto old = load.displacement.find(node); old != load.displacement.end())
      from = old->second;
    load.displacement[node] = set.displacement;
    load.ramp.erase(node);
    if (set.duration > 0)
      load.ramp[node] = {from, set.displacement, w.now.clock.time, w.now.clock.time + set.duration};
  }
}

} // namespace

// ---- of any kind

void accept(World& w, const Change& change) {
  std::visit(
      [&]<class Kind>(const Kind& c) {
        Rule<Kind>::check(w, c);
        Rule<Kind>::enter(w, c);
      },
      change);
}

void announce(World& w, const Change& change) {
  std::visit([&]<class Kind>(const Kind& c) { Rule<Kind>::announce(w, c); }, change);
}

void apply(World& w, const Change& change) {
  std::visit(
      [&]<class Kind>(const Kind& c) {
        Rule<Kind>::check(w, c);
        Rule<Kind>::require(w, c);
        const auto work = [&] {
          Rule<Kind>::enter(w, c);
          note_poses(w); // the end of the ways so far
          Rule<Kind>::apply(w, c);
        };
        if constexpr (Rule<Kind>::may_fail)
          guarded(w, work);
        else
          work();
        if constexpr (Rule<Kind>::announces_behind)
          Rule<Kind>::announce(w, c);
      },
      change);
  if (w.options.applied)
    w.options.applied(change);
  if (w.options.log)
    w.options.log(row_of(w, change));
}

ChangeRow row_of(const World& w, const Change& change) {
  ChangeRow row;
  std::visit(
      [&]<class Kind>(const Kind& c) {
        log_names(w, c, row);
        Rule<Kind>::log(w, c, row);
      },
      change);
  return row;
}

void require_period(double period) {
  constexpr double min = 1e-9; // s
  if (!(period >= min))
    throw Error("a period of " + text::number_text(period) + " s, expected 1e-9 s or longer");
}

// ---- loads

void Rule<SetForce>::check(World&, const SetForce& c) {
  if (c.period > 0)
    require_period(c.period);
}
void Rule<SetForce>::apply(World& w, const SetForce& c) {
  Object& object = w.now.objects.at(c.object);
  contact::Load& load = object.load.write();
  for (const std::uint32_t node : c.nodes) {
    load.force_period.erase(node);
    if (c.force == Vec3{}) {
      load.force.erase(node);
      continue;
    }
    load.force[node] = c.force;
    if (c.period > 0)
      load.force_period[node] = c.period;
  }
  touch(object);
}
void Rule<SetForce>::log(const World&, const SetForce& c, ChangeRow& row) {
  row.what = "force";
  row.vector = c.force;
  row.duration = c.period;
}

void Rule<SetPressure>::check(World&, const SetPressure& c) {
  if (c.pressure.period > 0)
    require_period(c.pressure.period);
}
void Rule<SetPressure>::apply(World& w, const SetPressure& c) {
  Object& object = w.now.objects.at(c.object);
  contact::Load& load = object.load.write();
  for (const std::uint32_t node : c.nodes)
    if (c.pressure.pressure == 0)
      load.pressure.erase(node);
    else
      load.pressure[node] = c.pressure;
  touch(object);
}
void Rule<SetPressure>::log(const World&, const SetPressure& c, ChangeRow& row) {
  row.what = "pressure";
  row.value = c.pressure.pressure;
  row.duration = c.pressure.period;
}

void Rule<SetMass>::check(World& w, const SetMass& c) {
  need_model(w.now.objects.at(c.object));
  if (!(c.mass >= 0 && c.mass <= largest_number))
    throw Error("a mass of " + text::number_text(c.mass) + " g, expected one from 0 to 1e38 g");
}
void Rule<SetMass>::apply(World& w, const SetMass& c) {
  Object& object = w.now.objects.at(c.object);
  std::map<std::uint32_t, double>& hung = object.hung.write();
  const std::map<std::uint32_t, double> before = hung;
  for (const std::uint32_t node : c.nodes)
    if (c.mass == 0)
      hung.erase(node);
    else
      hung[node] = c.mass;
  if (hung == before)
    return;
  if (object.body != nullptr)
    make_body_again(w, c.object);
  touch(object);
}
void Rule<SetMass>::log(const World&, const SetMass& c, ChangeRow& row) {
  row.what = "mass";
  row.value = c.mass;
}

void Rule<SetDisplacement>::check(World& w, const SetDisplacement& c) {
  Object& object = w.now.objects.at(c.object);
  need_model(object);
  const double max = displacement_limit(object);
  for (int a = 0; a < 3; ++a)
    if (!(std::abs(c.displacement[a]) <= max))
      throw Error("a displacement of " + text::number_text(c.displacement[a]) +
                  " mm, expected at most a million times the size of the object, " +
                  text::number_text(max) + " mm");
  for (const std::uint32_t node : c.nodes)
    for (int a = 0; a < 3; ++a)
      if (contact::is_fixed(object.model(), node, a) && c.displacement[a] != 0)
        throw Error("node " + std::to_string(node) + " is fixed along " + "xyz"[a] +
                    ", expected a displacement of 0 there");
}
void Rule<SetDisplacement>::apply(World& w, const SetDisplacement& c) {
  Object& object = w.now.objects.at(c.object);
  drop_grips(w, c.object, c.nodes);
  displace(w, object, c);
  touch(object);
}
void Rule<SetDisplacement>::log(const World&, const SetDisplacement& c, ChangeRow& row) {
  row.what = "displace";
  row.vector = c.displacement;
  row.duration = c.duration;
}

void Rule<Release>::apply(World& w, const Release& c) {
  Object& object = w.now.objects.at(c.object);
  drop_grips(w, c.object, c.nodes);
  contact::Load& load = object.load.write();
  for (const std::uint32_t node : c.nodes) {
    load.force.erase(node);
    load.force_period.erase(node);
    load.pressure.erase(node);
    load.displacement.erase(node);
    load.ramp.erase(node);
  }
  touch(object);
}

// ---- the scene as a whole

void Rule<SetGravity>::apply(World& w, const SetGravity& c) {
  w.now.gravity = c.gravity;
  for (Object& object : w.now.objects) {
    object.load.write().gravity = c.gravity;
    touch(object);
  }
}
void Rule<SetGravity>::log(const World&, const SetGravity& c, ChangeRow& row) {
  row.what = "gravity";
  row.vector = c.gravity;
}

void Rule<SetTimestep>::apply(World& w, const SetTimestep& c) {
  w.now.settings.timestep = c.dt;
  w.now.settings.order = c.order;
}
void Rule<SetTimestep>::log(const World&, const SetTimestep& c, ChangeRow& row) {
  row.what = "timestep";
  row.value = c.dt;
  row.text = c.order == 2 ? "order=2" : "";
}

void Rule<Emit>::apply(World& w, const Emit& c) {
  (c.instruments ? w.now.settings.emits.instruments
   : c.forces    ? w.now.settings.emits.forces
   : c.surfaces  ? w.now.settings.emits.surfaces
                 : w.now.settings.emits.shapes) = true;
}
void Rule<Emit>::log(const World&, const Emit& c, ChangeRow& row) {
  row.what = "emit";
  row.text = c.instruments ? "instruments"
             : c.forces    ? "forces"
             : c.surfaces  ? "surfaces"
                           : "shapes";
}

} // namespace gewebe::scene
