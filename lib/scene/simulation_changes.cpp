// Changes: what acts on objects, now or later.

#include "scene/simulation_internal.h"

#include <algorithm>
#include <cmath>
#include <variant>

namespace gewebe {

using simulation::number_text;

namespace {

constexpr double least_period = 1e-9; // s

/// Shorter ones are lost in the rounding of the time, sooner or later.
void require_period(double period) {
  if (!(period >= least_period))
    throw Error("a period of " + number_text(period) + " s, expected 1e-9 s or longer");
}

} // namespace

void Simulation::check(const Change& change) const {
  check_instrument(change);
  if (const auto* const force = std::get_if<SetForce>(&change);
      force != nullptr && force->period > 0)
    require_period(force->period);
  if (const auto* const press = std::get_if<SetPressure>(&change);
      press != nullptr && press->pressure.period > 0)
    require_period(press->pressure.period);
  if (const auto* const tie = std::get_if<Attach>(&change)) {
    const Object &a = *objects_.at(tie->object), &b = *objects_.at(tie->other);
    for (const Object* const o : {&a, &b})
      if (o->method != Method::ela)
        throw Error("object " + o->name +
                    " is elastostatic (ffe) and has no motion to tie, expected ela objects");
    if (&a == &b)
      throw Error("object " + a.name + " can't be attached to itself, expected two objects");
    if (a.integration != b.integration)
      throw Error("one of " + a.name + " and " + b.name +
                  " is implicit and the other is not, expected both alike");
    return;
  }
  if (const auto* const stages = std::get_if<SetTwoStep>(&change)) {
    const Object& object = *objects_.at(stages->object);
    if (object.method != Method::ffe)
      throw Error("object " + object.name +
                  " is elastodynamic (ela), expected an elastostatic one for two-step");
    if (object.first)
      throw Error("object " + object.name +
                  " is cut and its second stage is not, expected one that is whole");
    return;
  }
  const auto* const set = std::get_if<SetDisplacement>(&change);
  if (set == nullptr)
    return;
  const Model& model = this->model(set->object);
  const double most = displacement_limit(*objects_[set->object]);
  for (int a = 0; a < 3; ++a)
    if (!(std::abs(set->displacement[a]) <= most))
      throw Error("a displacement of " + number_text(set->displacement[a]) +
                  " mm, expected at most a million times the size of the object, " +
                  number_text(most) + " mm");
  for (const std::uint32_t node : set->nodes)
    for (int a = 0; a < 3; ++a)
      if (is_fixed(model, node, a) && set->displacement[a] != 0)
        throw Error("node " + std::to_string(node) + " is fixed along " + "xyz"[a] +
                    ", expected a displacement of 0 there");
}

void Simulation::apply(const Change& change) {
  check(change);
  require_instrument(change);
  introduce(change);
  // The others can't fail behind their check.
  if (std::holds_alternative<Attach>(change) || std::holds_alternative<SetMethod>(change) ||
      std::holds_alternative<CutObject>(change) || std::holds_alternative<Restore>(change) ||
      std::holds_alternative<Grasp>(change))
    guarded([&] { apply_now(change); });
  else
    apply_now(change);
  if (!std::holds_alternative<CutObject>(change))
    announce_cuts(change);
  if (options_.applied)
    options_.applied(change);
}

/// \pre check(change) passes
void Simulation::apply_now(const Change& change) {
  if (apply_instrument(change))
    return;
  Object* touched = nullptr;
  const auto touch = [&](std::size_t object) {
    touched = objects_.at(object).get();
    keep_load(*touched);
  };
  if (const auto* const force = std::get_if<SetForce>(&change)) {
    touch(force->object);
    for (const std::uint32_t node : force->nodes) {
      touched->load.force_period.erase(node);
      if (force->force == Vec3{}) {
        touched->load.force.erase(node);
        continue;
      }
      touched->load.force[node] = force->force;
      if (force->period > 0)
        touched->load.force_period[node] = force->period;
    }
  } else if (const auto* const press = std::get_if<SetPressure>(&change)) {
    touch(press->object);
    for (const std::uint32_t node : press->nodes)
      if (press->pressure.pressure == 0)
        touched->load.pressure.erase(node);
      else
        touched->load.pressure[node] = press->pressure;
  } else if (const auto* const set = std::get_if<SetDisplacement>(&change)) {
    touch(set->object);
    drop_grips(set->object, set->nodes);
    displace(*touched, *set);
  } else if (const auto* const tie = std::get_if<Attach>(&change)) {
    attach(*tie);
  } else if (const auto* const release = std::get_if<Release>(&change)) {
    touch(release->object);
    drop_grips(release->object, release->nodes);
    for (const std::uint32_t node : release->nodes) {
      touched->load.force.erase(node);
      touched->load.force_period.erase(node);
      touched->load.pressure.erase(node);
      touched->load.displacement.erase(node);
      touched->load.travel.erase(node);
    }
  } else if (const auto* const pull = std::get_if<SetGravity>(&change)) {
    gravity_ = pull->gravity;
    for (const auto& object : objects_) {
      keep_load(*object);
      object->load.gravity = gravity_;
      object->shown = false;
      if (object->body != nullptr)
        object->body->changed = true;
    }
  } else if (const auto* const wish = std::get_if<SetTimestep>(&change)) {
    timestep_ = wish->dt;
  } else if (const auto* const method = std::get_if<SetMethod>(&change)) {
    set_method(method->object, method->method);
  } else if (const auto* const cut = std::get_if<CutObject>(&change)) {
    cut_now(*cut);
  } else if (const auto* const whole = std::get_if<Restore>(&change)) {
    restore_now(whole->object);
  } else if (const auto* const tearing = std::get_if<SetTear>(&change)) {
    Object& object = *objects_.at(tearing->object);
    undo_->note([&object, old = object.tear] { object.tear = old; });
    object.tear = tearing->strain;
  } else if (const auto* const again = std::get_if<Renew>(&change)) {
    touch(again->object);
    if (undo_->open)
      undo_->updated.insert(touched);
    renew(*touched);
  } else if (const auto* const stages = std::get_if<SetTwoStep>(&change)) {
    touch(stages->object);
    set_two_step(*touched, *stages);
  } else if (std::get<Emit>(change).instruments) {
    emit_instruments_ = true;
  } else if (std::get<Emit>(change).forces) {
    emit_forces_ = true;
  } else {
    emit_shapes_ = true;
  }
  if (touched == nullptr)
    return;
  touched->shown = false;
  if (touched->body != nullptr)
    touched->body->changed = true;
}

void Simulation::displace(Object& object, const SetDisplacement& set) {
  for (const std::uint32_t node : set.nodes) {
    Vec3 from;
    if (object.body != nullptr)
      from = object.body->moving->motion()[object.offset + node].displacement;
    else if (const auto old = object.load.displacement.find(node);
             old != object.load.displacement.end())
      from = old->second;
    object.load.displacement[node] = set.displacement;
    object.load.travel.erase(node);
    if (set.over > 0)
      object.load.travel[node] = {from, set.displacement, time_, time_ + set.over};
  }
}

void Simulation::schedule(double time, const Change& change) {
  if (!(time >= time_))
    throw Error("the time " + number_text(time) + " s is past, expected " + number_text(time_) +
                " s or later");
  if (time == time_) {
    apply(change);
    return;
  }
  check(change);
  introduce(change);
  announce_cuts(change);
  events_.emplace(time, Event{change});
}

void Simulation::schedule_every(double period, const Change& change) {
  require_period(period);
  check(change);
  introduce(change);
  events_.emplace(time_ + period, Event{change, time_, period, 1});
}

std::size_t Simulation::pending() const noexcept {
  return static_cast<std::size_t>(std::count_if(
      events_.begin(), events_.end(), [](const auto& e) { return e.second.period == 0; }));
}

} // namespace gewebe
