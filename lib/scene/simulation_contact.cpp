// Instruments: where they go, what they grasp, whom they touch.

#include "base/vector_at.h"
#include "scene/simulation_internal.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>
#include <variant>

namespace gewebe {

using simulation::largest_number;
using simulation::number_text;

namespace {

constexpr std::size_t most_parts = 256; ///< of an instrument's way in one step

Box3 joined(Box3 a, const Box3& b) {
  a.add(b.min);
  a.add(b.max);
  return a;
}

Box3 box_at(const InstrumentShape& shape, const Pose& pose) {
  return PlacedInstrument(shape, pose).box();
}

/// Of all that the instrument passes between two poses.
Box3 box_between(const InstrumentShape& shape, const Pose& from, const Pose& to) {
  Box3 box = joined(box_at(shape, from), box_at(shape, to));
  if (from.turn == to.turn)
    return box;
  const double reach = norm(shape.axis); // an end turns about the place
  return joined(box, {box.min - Vec3{reach, reach, reach}, box.max + Vec3{reach, reach, reach}});
}

/// One touch for each node and instrument, by ascending ones: the sums over `duration`.
std::vector<NodeTouch> means_of(std::vector<NodeTouch> impulses, double duration) {
  std::vector<NodeTouch> all = sums_of_touches(std::move(impulses));
  for (NodeTouch& t : all)
    t.force = t.force / duration;
  return all;
}

} // namespace

std::size_t Simulation::instrument_place(const std::string& name) const noexcept {
  const auto at = std::find_if(instruments_.begin(), instruments_.end(),
                               [&](const auto& i) { return i->name == name; });
  return static_cast<std::size_t>(at - instruments_.begin());
}

std::size_t Simulation::add_instrument(const std::string& name) {
  const std::size_t place = instrument_place(name);
  if (place == instruments_.size()) {
    instruments_.push_back(std::make_unique<Instrument>());
    instruments_.back()->name = name;
  }
  return place;
}

/// A new instrument is known from when the command that puts it there is accepted, be it for later.
void Simulation::introduce(const Change& change) {
  if (const auto* const set = std::get_if<SetInstrument>(&change);
      set != nullptr && set->instrument == instruments_.size())
    add_instrument(set->name);
}

const std::string& Simulation::instrument_name(std::size_t instrument) const {
  return instruments_.at(instrument)->name;
}

std::size_t Simulation::find_instrument(const std::string& name) const {
  std::string list;
  for (std::size_t k = 0; k < instruments_.size(); ++k) {
    if (instruments_[k]->name == name)
      return k;
    list += (list.empty() ? "" : ", ") + instruments_[k]->name;
  }
  throw Error("there is no instrument '" + name + "', expected " +
              (list.empty() ? "an instrument command first" : "one of " + list));
}

InstrumentReport Simulation::instrument(std::size_t instrument) const {
  const Instrument& i = *instruments_.at(instrument);
  InstrumentReport report{.present = i.present, .pose = i.way.at(time_), .force = {}, .torque = {}};
  if (!i.present)
    return report;
  const auto add = [&](const Vec3& at, const Vec3& force) {
    report.force -= force;
    report.torque -= cross(at - report.pose.place, force);
    ++report.nodes;
  };
  for (const auto& object : objects_)
    for (const NodeTouch& t : object->touches)
      if (t.instrument == instrument)
        add(object->model.nodes[t.node].position + vector_at(object->displacement, t.node),
            t.force);
  for (const Instrument::Grip& grip : i.grips) {
    const Object& object = *objects_[grip.object];
    const auto f =
        std::lower_bound(object.forces.begin(), object.forces.end(), grip.node,
                         [](const NodeVector& v, std::uint32_t node) { return v.node < node; });
    if (f != object.forces.end() && f->node == grip.node)
      add(report.pose(grip.point), f->value);
  }
  return report;
}

Simulation::Instrument& Simulation::present_instrument(std::size_t instrument) const {
  Instrument& i = *instruments_.at(instrument);
  if (!i.present)
    throw Error("the instrument " + i.name +
                " is not in the scene now, expected an instrument command before");
  return i;
}

void Simulation::check_instrument(const Change& change) const {
  const auto require_single = [](std::initializer_list<Vec3> all, double radius) {
    for (const Vec3& v : all)
      radius = std::max({radius, std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    if (!(radius <= largest_number))
      throw Error("an instrument of or at " + number_text(radius) +
                  " mm, expected numbers within single precision");
  };
  if (const auto* const set = std::get_if<SetInstrument>(&change))
    require_single({set->pose.place, set->shape.axis}, set->shape.radius);
  if (const auto* const move = std::get_if<MoveInstrument>(&change))
    require_single({move->place}, 0);
  if (const auto* const grasp = std::get_if<Grasp>(&change)) {
    const Model& model = this->model(grasp->object);
    for (const std::uint32_t node : grasp->nodes)
      if (model.nodes[node].fixed != fixed_none)
        throw Error("node " + std::to_string(node) +
                    " is fixed, expected nodes that can follow an instrument");
  }
}

/// That a change of an instrument can take effect now.
void Simulation::require_instrument(const Change& change) const {
  if (const auto* const move = std::get_if<MoveInstrument>(&change))
    (void)present_instrument(move->instrument);
  if (const auto* const withdraw = std::get_if<Withdraw>(&change))
    (void)present_instrument(withdraw->instrument);
  const auto* const grasp = std::get_if<Grasp>(&change);
  if (grasp != nullptr && present_instrument(grasp->instrument).shape.blade)
    throw Error("the instrument " + instruments_[grasp->instrument]->name +
                " is a blade, expected one that can hold nodes");
}

/// \return whether it was a change of instruments, which then has taken effect
bool Simulation::apply_instrument(const Change& change) {
  note_poses(); // the end of the ways so far
  if (const auto* const set = std::get_if<SetInstrument>(&change)) {
    Instrument& i = *instruments_.at(set->instrument);
    drop_grips(set->instrument);
    i.changed = i.changed || !set->shape.blade || (i.present && !i.shape.blade);
    i.present = false;
    note_poses(); // it takes no way from where it was
    i.present = true;
    i.path.clear();
    i.shape = set->shape;
    i.way = {set->pose, set->pose, time_, time_};
    i.before = set->pose;
  } else if (const auto* const move = std::get_if<MoveInstrument>(&change)) {
    Instrument& i = *instruments_[move->instrument];
    const Pose from = i.way.at(time_);
    i.way = {from, {move->place, move->turn.value_or(from.turn)}, time_, time_ + move->over};
    carry(i);
  } else if (const auto* const grasp = std::get_if<Grasp>(&change)) {
    Instrument& i = *instruments_[grasp->instrument];
    Object& object = *objects_.at(grasp->object);
    shape_in_step(object); // where the nodes stand
    keep_load(object);
    drop_grips(grasp->object, grasp->nodes);
    const Pose pose = i.way.at(time_);
    for (const std::uint32_t node : grasp->nodes) {
      const Vec3 u = object.body != nullptr
                         ? object.body->moving->motion()[object.offset + node].displacement
                         : vector_at(object.displacement, node);
      i.grips.push_back({grasp->object, node, pose.inverse(object.model.nodes[node].position + u)});
      object.load.displacement[node] = u;
      object.load.travel.erase(node);
    }
    object.shown = false;
    if (object.body != nullptr)
      object.body->changed = true;
    if (time_ < i.way.end)
      carry(i);
  } else if (const auto* const withdraw = std::get_if<Withdraw>(&change)) {
    Instrument& i = *instruments_[withdraw->instrument];
    drop_grips(withdraw->instrument);
    i.present = false;
    i.changed = i.changed || !i.shape.blade;
  } else {
    return false;
  }
  note_poses();
  return true;
}

/// Gives grasped nodes the way of their instrument.
void Simulation::carry(const Instrument& instrument) {
  for (const Instrument::Grip& grip : instrument.grips) {
    Object& object = *objects_[grip.object];
    keep_load(object);
    const Carrier by{instrument.way, grip.point, object.model.nodes[grip.node].position};
    const Vec3 to = by.at(instrument.way.end);
    object.load.displacement[grip.node] = to;
    object.load.travel.erase(grip.node);
    if (instrument.way.end > time_)
      object.load.travel[grip.node] = {by.at(time_), to, time_, instrument.way.end, by};
    object.shown = false;
    if (object.body != nullptr)
      object.body->changed = true;
  }
}

void Simulation::drop_grips(std::size_t object, const std::vector<std::uint32_t>& nodes) {
  for (const auto& i : instruments_)
    if (!i->grips.empty())
      std::erase_if(i->grips, [&](const Instrument::Grip& grip) {
        return grip.object == object &&
               std::find(nodes.begin(), nodes.end(), grip.node) != nodes.end();
      });
}

void Simulation::drop_grips(std::size_t instrument) {
  std::map<std::size_t, std::vector<std::uint32_t>> held;
  for (const Instrument::Grip& grip : instruments_[instrument]->grips)
    held[grip.object].push_back(grip.node);
  instruments_[instrument]->grips.clear();
  for (const auto& [object, nodes] : held)
    apply_now(Release{object, nodes});
}

/// Remembers where the instruments are.
void Simulation::note_poses() {
  if (instruments_.empty())
    return;
  std::vector<std::optional<Pose>> now; // of those that push
  for (const auto& i : instruments_) {
    now.push_back(i->present && !i->shape.blade ? std::optional(i->way.at(time_)) : std::nullopt);
    if (!i->present || !i->shape.blade)
      continue;
    if (const Pose pose = i->way.at(time_); i->path.empty() || i->path.back() != pose)
      i->path.push_back(pose);
  }
  if (poses_.empty() || poses_.back() != now)
    poses_.push_back(std::move(now));
}

// ---- elastodynamic objects

/// Tells a body that is to move of the instruments, and wakes it where one comes.
void Simulation::guide(Body& body, double to) {
  if (!instruments_there())
    return;
  std::vector<std::optional<MovingInstrument>> all;
  bool any = false;
  for (const auto& i : instruments_) {
    const bool pushes = i->present && !i->shape.blade;
    any = any || pushes;
    all.push_back(pushes ? std::optional(MovingInstrument{i->shape, i->before, i->way})
                         : std::nullopt);
  }
  if (any && objects_[body.parts[0]]->integration == Integration::implicit) {
    if (!body.warned_implicit && options_.warn)
      options_.warn("object " + objects_[body.parts[0]]->name +
                    " is integrated implicitly: instruments don't touch it");
    body.warned_implicit = true;
    return;
  }
  if (!body.moving->resting()) {
    body.rest_box.reset();
  } else {
    if (!body.rest_box) {
      body.rest_box.emplace();
      for (const std::size_t part : body.parts) {
        const Object& object = *objects_[part];
        for (std::size_t k = 0; k < surface_count(object.model); ++k)
          body.rest_box->add(object.model.nodes[k].position +
                             body.moving->motion()[object.offset + k].displacement);
      }
    }
    for (const auto& i : instruments_) {
      const Pose now = i->way.at(to);
      if (!i->changed && (i->before == now || i->shape.blade))
        continue;
      if (body.touched || (i->present && !i->shape.blade &&
                           near(box_between(i->shape, i->before, now), *body.rest_box)))
        body.moving->wake();
    }
  }
  if (!body.moving->resting())
    body.moving->set_instruments(std::move(all));
}

void Simulation::end_guiding(double to) {
  for (const auto& i : instruments_) {
    i->before = i->way.at(to);
    i->changed = false;
  }
}

/// What instruments did to a body so far in this step goes to its objects: their nodes are
/// followed.
void Simulation::gather_impulses(Body& body) {
  const std::vector<NodeTouch> all = body.moving->take_impulses();
  for (const std::size_t part : body.parts) {
    Object& object = *objects_[part];
    for (const NodeTouch& t : all)
      if (t.node >= object.offset && t.node - object.offset < object.model.nodes.size())
        object.impulses.push_back(
            {t.node - static_cast<std::uint32_t>(object.offset), t.instrument, t.force});
  }
}

/// Behind a step: forces of instruments on elastodynamic objects, means over its time.
void Simulation::take_touches(double duration) {
  if (instruments_.empty() || !(duration > 0))
    return;
  for (const auto& body : bodies_) {
    // As they are at rest, exactly, where it rested all the time.
    const std::optional<std::vector<NodeTouch>> held = body->moving->held_touches(duration);
    gather_impulses(*body);
    body->touched = false;
    for (const std::size_t part : body->parts) {
      Object& object = *objects_[part];
      std::vector<NodeTouch> touches;
      const std::size_t end = object.offset + object.model.nodes.size();
      if (held) {
        for (const NodeTouch& t : *held)
          if (t.node >= object.offset && t.node < end)
            touches.push_back(
                {t.node - static_cast<std::uint32_t>(object.offset), t.instrument, t.force});
      } else {
        touches = means_of(std::move(object.impulses), duration);
      }
      object.impulses.clear();
      body->touched = body->touched || !touches.empty();
      if (held && touches == object.touches)
        continue;
      object.shown = object.shown && object.touches.empty() && touches.empty();
      object.touches = std::move(touches);
    }
  }
  for (const auto& object : objects_)
    object->impulses.clear(); // of those that left their body for good
}

// ---- elastostatic objects

/// Whether there are, or have just been.
bool Simulation::instruments_there() const {
  return std::any_of(instruments_.begin(), instruments_.end(),
                     [](const auto& i) { return (i->present && !i->shape.blade) || i->changed; });
}

/// Whether instruments moved where this object feels it.
bool Simulation::touched_anew(Object& object) {
  if (object.method != Method::ffe || object.stages || poses_.empty() ||
      (object.contact && poses_.size() < 2))
    return false;
  if (!object.touches.empty())
    return true;
  const bool first = !object.contact;
  if (first && !instruments_there())
    return false;
  need_contact(object);
  for (std::size_t k = 0; k < instruments_.size(); ++k)
    for (std::size_t p = first ? 0 : 1; p < poses_.size(); ++p) {
      const std::optional<Pose> now = pose_at(p, k), before = p > 0 ? pose_at(p - 1, k) : now;
      if (now && near(box_between(instruments_[k]->shape, before.value_or(*now), *now),
                      object.contact->box()))
        return true;
    }
  return false;
}

void Simulation::need_contact(Object& object) {
  need_model(object);
  shape_in_step(object);
  if (object.contact)
    return;
  undo_->note([&object] { object.contact.reset(); });
  object.contact = std::make_unique<StaticContact>(object.model, object.displacement);
}

std::optional<Pose> Simulation::pose_at(std::size_t moment, std::size_t instrument) const {
  const std::vector<std::optional<Pose>>& all = poses_[moment];
  return instrument < all.size() ? all[instrument] : std::nullopt;
}

/// An elastostatic object's shape behind all the ways that the instruments took since it was shown.
void Simulation::follow_instruments(Object& object) {
  if (undo_->open)
    undo_->updated.insert(&object);
  if (!object.contact) {
    undo_->note([&object] { object.contact.reset(); });
    object.contact = std::make_unique<StaticContact>(object.model, object.displacement);
  }
  const std::size_t count = instruments_.size();
  bool solved = true;
  // An object that nothing ever acted on has no shape to find.
  const bool changed = !object.touches.empty() ||
                       ((object.still || !object.load.empty()) &&
                        (!object.shown || object.load.changes_until() > object.shown_time));
  for (std::size_t p = poses_.size() > 1 ? 1 : 0; p < poses_.size(); ++p) {
    std::vector<MovedInstrument> moved;
    for (std::size_t k = 0; k < count; ++k)
      if (const auto now = pose_at(p, k))
        moved.push_back(
            {instruments_[k]->shape, p > 0 ? pose_at(p - 1, k).value_or(*now) : *now, *now});
    const std::size_t parts = parts_of_way(moved, most_parts);
    for (std::size_t part = 1; part <= parts; ++part) {
      const auto at = [&](std::size_t n) {
        return static_cast<double>(n) / static_cast<double>(parts);
      };
      std::vector<std::optional<MovedInstrument>> here(count);
      std::size_t next = 0;
      for (std::size_t k = 0; k < count; ++k)
        if (pose_at(p, k)) {
          const MovedInstrument& way = moved[next++];
          here[k] = MovedInstrument{way.shape, between(way.before, way.now, at(part - 1)),
                                    between(way.before, way.now, at(part))};
        }
      const bool last = changed && p + 1 == poses_.size() && part == parts;
      object.contact->update([&]() -> Elastostatic& { return still_of(object); }, object.shown_load,
                             here, object.displacement, last);
      solved = solved && object.contact->solved();
    }
  }
  object.touches = object.contact->touches();
  if (const auto stuck = object.contact->stuck(); stuck && !object.warned_stuck && options_.warn) {
    object.warned_stuck = true;
    options_.warn("object " + object.name + " at " + number_text(time_) + " s: node " +
                  std::to_string(stuck->node) + " is fixed, the instrument " +
                  instruments_[stuck->instrument]->name + " goes through it");
  }
  if (!solved && !object.warned_unsolved && options_.warn) {
    object.warned_unsolved = true;
    options_.warn("object " + object.name + " at " + number_text(time_) +
                  " s: the forces of instruments are not exact, expected a slower way");
  }
}

/// Among the forces that are shown.
void Simulation::add_touches(Object& object) {
  for (const NodeTouch& t : object.touches) {
    const auto at =
        std::lower_bound(object.forces.begin(), object.forces.end(), t.node,
                         [](const NodeVector& v, std::uint32_t node) { return v.node < node; });
    if (at != object.forces.end() && at->node == t.node)
      at->value += t.force;
    else
      object.forces.insert(at, {t.node, t.force});
  }
}

} // namespace gewebe
