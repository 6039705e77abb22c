// Whom instruments touch: elastodynamic objects on their way, elastostatic ones in their shape.

#include "base/vector_at.h"
#include "scene/world_internal.h"
#include "statics/elastostatic_yielding.h"
#include "statics/two_step_contact.h"
#include "statics/warped_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace gewebe::simulation {

namespace {

constexpr std::size_t max_parts = 256; ///< of an instrument's way in one step

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
  const double reach = reach_of(shape); // an end turns about the place
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

/// Once: what is told of forces is not to be trusted.
void warn_inexact(World& w, Object& object) {
  if (object.matter->told.unsolved || !w.options.warn)
    return;
  object.matter->told.unsolved = true;
  w.options.warn("object " + object.name() + " at " + number_text(w.now.clock.time) +
                 " s: the forces of " + (w.now.instruments.empty() ? "contact" : "instruments") +
                 " are not exact, expected a slower way");
}

namespace {

/// Whether the instrument touched it in the last step.
bool touched_by(const World& w, const Body& body, std::size_t instrument) {
  return body.touched && std::ranges::any_of(all_of(body), [&](std::size_t part) {
           return std::ranges::any_of(w.now.objects[part].shown.touches, [&](const NodeTouch& t) {
             return t.instrument == instrument;
           });
         });
}

} // namespace

// ---- elastodynamic objects

/// Tells a body that is to move of the instruments, and wakes it where one comes.
void guide(World& w, Body& body, double to, Extents& extents) {
  if (!instruments_there(w))
    return;
  std::vector<std::optional<MovingInstrument>> all;
  const auto met_by = [&](const Instrument& i) {
    MovingInstrument met{i.shape, i.before, i.way};
    if (!i.coupled)
      return met;
    if (gives_way_to(w, i, w.now.objects[body.parts[0]]))
      met.led = i.coupled->led;
    else
      met.way = {i.pose(w.now.clock.time), i.coupled->end, w.now.clock.time, to, true};
    return met;
  };
  for (const Instrument& i : w.now.instruments)
    all.push_back(i.present && !i.shape.blade ? std::optional(met_by(i)) : std::nullopt);
  if (body.moving->resting()) {
    const auto near_any = [&](const Box3& way) {
      return std::ranges::any_of(all_of(body),
                                 [&](std::size_t part) { return near(way, extents.of(part).box); });
    };
    for (std::size_t k = 0; k < w.now.instruments.size(); ++k) {
      const Instrument& i = w.now.instruments[k];
      const Pose now = i.present && i.coupled ? i.coupled->end : i.way.at(to);
      if (!i.changed && (i.before == now || i.shape.blade))
        continue;
      if (touched_by(w, body, k) ||
          (i.present && !i.shape.blade && near_any(box_between(i.shape, i.before, now))))
        body.moving->wake();
    }
  }
  if (!body.moving->resting())
    body.moving->set_instruments(std::move(all));
}

void end_guiding(World& w, double to) {
  follow_hands(w, to);
  for (Instrument& i : w.now.instruments) {
    i.before = i.pose(to);
    i.changed = false;
  }
}

/// What instruments did to a body so far in this step goes to its objects: their nodes are
/// followed.
void gather_impulses(World& w, Body& body) {
  const std::vector<NodeTouch> all = body.moving->take_impulses();
  for (const std::size_t part : body.parts) {
    Object& object = w.now.objects[part];
    for (const NodeTouch& t : all)
      if (t.node >= object.offset && t.node - object.offset < object.model().nodes.size())
        object.impulses.push_back(
            {t.node - static_cast<std::uint32_t>(object.offset), t.instrument, t.force});
  }
}

/// Behind a step: forces of instruments on elastodynamic objects, means over its time.
void take_touches(World& w, double duration) {
  if ((w.now.instruments.empty() && w.now.meetings.empty()) || !(duration > 0))
    return;
  for (const auto& body : w.now.bodies) {
    // As they are at rest, exactly, where it rested all the time.
    const std::optional<std::vector<NodeTouch>> held = body->moving->held_touches(duration);
    gather_impulses(w, *body);
    body->touched = false;
    if (!body->moving->touches_exact())
      warn_inexact(w, w.now.objects[body->parts[0]]);
    for (const std::size_t part : body->parts) {
      Object& object = w.now.objects[part];
      std::vector<NodeTouch> touches;
      const std::size_t end = object.offset + object.model().nodes.size();
      if (held) {
        for (const NodeTouch& t : *held)
          if (t.node >= object.offset && t.node < end)
            touches.push_back(
                {t.node - static_cast<std::uint32_t>(object.offset), t.instrument, t.force});
      } else {
        touches = means_of(std::move(object.impulses), duration);
      }
      object.impulses.clear();
      body->touched = body->touched || std::ranges::any_of(touches, [](const NodeTouch& t) {
                        return t.instrument != other_surface;
                      });
      if (held && touches == object.shown.touches)
        continue;
      object.shown.valid = object.shown.valid && object.shown.touches.empty() && touches.empty();
      object.shown.touches = std::move(touches);
    }
    const std::vector<NodeTouch> beside = body->moving->standing_touches();
    body->touched = body->touched || std::ranges::any_of(beside, [](const NodeTouch& t) {
                      return t.instrument != other_surface;
                    });
  }
  for (Object& object : w.now.objects)
    object.impulses.clear(); // of those that left their body for good
}

// ---- elastostatic objects

namespace {

void need_contact(Object& object) {
  if (object.contact)
    return;
  if (object.contact_ahead) {
    object.contact = std::exchange(object.contact_ahead, nullptr);
    object.contact->restart(*object.shown.displacement, {});
  } else {
    object.contact = std::make_shared<StaticContact>(object.model(), *object.shown.displacement);
  }
}

} // namespace

/// Whether instruments moved where this object feels it.
bool touched_anew(World& w, Object& object) {
  if (object.method != Method::ffe || gap_of(object, Feature::touch) != nullptr ||
      w.now.poses.empty() || (object.contact && w.now.poses.size() < 2))
    return false;
  if (!object.shown.touches.empty())
    return true;
  const bool first = !object.contact;
  if (first && !instruments_there(w))
    return false;
  need_model(object);
  shape_in_step(w, object);
  need_contact(object);
  return passed_by_instruments(w, object.contact->box(), first);
}

/// Whether one comes near to a box on its way since the scene was shown. \param first where they
/// stood before counts too
bool passed_by_instruments(const World& w, const Box3& box, bool first) {
  for (std::size_t k = 0; k < w.now.instruments.size(); ++k)
    for (std::size_t p = first ? 0 : 1; p < w.now.poses.size(); ++p) {
      const std::optional<Pose> now = pose_at(w, p, k), before = p > 0 ? pose_at(w, p - 1, k) : now;
      if (now && near(box_between(w.now.instruments[k].shape, before.value_or(*now), *now), box))
        return true;
    }
  return false;
}

std::vector<ShortWay> short_ways(const World& w, std::span<Object* const> objects) {
  std::vector<ShortWay> all;
  const std::size_t count = w.now.instruments.size();
  for (std::size_t p = w.now.poses.size() > 1 ? 1 : 0; p < w.now.poses.size(); ++p) {
    std::vector<MovedInstrument> moved;
    for (std::size_t k = 0; k < count; ++k)
      if (const auto now = pose_at(w, p, k))
        moved.push_back(
            {w.now.instruments[k].shape, p > 0 ? pose_at(w, p - 1, k).value_or(*now) : *now, *now});
    const std::size_t parts = parts_of_way(moved, max_parts);
    for (std::size_t part = 1; part <= parts; ++part) {
      const auto at = [&](std::size_t n) {
        return static_cast<double>(n) / static_cast<double>(parts);
      };
      ShortWay& here = all.emplace_back();
      here.instruments.resize(count);
      here.last = p + 1 == w.now.poses.size() && part == parts;
      std::size_t next = 0;
      for (std::size_t k = 0; k < count; ++k)
        if (pose_at(w, p, k)) {
          const MovedInstrument& way = moved[next++];
          std::optional<MovedInstrument>& one = here.instruments[k];
          one = MovedInstrument{way.shape, between(way.before, way.now, at(part - 1)),
                                between(way.before, way.now, at(part))};
          if (here.last && std::ranges::any_of(objects, [&](const Object* object) {
                return gives_way_to(w, w.now.instruments[k], *object);
              }))
            one = led_here(w, w.now.instruments[k], *one);
        }
    }
  }
  return all;
}

// An object that nothing ever acted on has no shape to find.
bool acted_anew(const Object& object) {
  return (object.statics->made() || !object.load->empty()) &&
         (!object.shown.valid || object.load->changes_until() > object.shown.time);
}

void tell_stuck(World& w, Object& object, const NodeTouch& stuck) {
  if (object.matter->told.stuck || !w.options.warn)
    return;
  object.matter->told.stuck = true;
  w.options.warn("object " + object.name() + " at " + number_text(w.now.clock.time) + " s: node " +
                 std::to_string(stuck.node) + " is fixed, the instrument " +
                 w.now.instruments[stuck.instrument].name + " goes through it");
}

/// Those that give way to one of the objects have gone.
void settle_led(World& w, std::span<Object* const> objects) {
  for (std::size_t k = 0; k < w.now.instruments.size(); ++k)
    if (pose_at(w, w.now.poses.size() - 1, k) &&
        std::ranges::any_of(objects, [&](const Object* object) {
          return gives_way_to(w, w.now.instruments[k], *object);
        }))
      settle(w, k, objects);
}

/// An elastostatic object's shape behind all the ways that the instruments took since it was shown.
/// \param part null: all of it; else what was known of the last one becomes what is known of it
void follow_instruments(World& w, Object& object, PartShown* part) {
  object.statics->ahead = true;
  need_contact(object);
  const std::array<Object*, 1> objects{&object};
  bool solved = true;
  const TwoStepYielding::Stages stages = [&]() -> std::pair<Elastostatic&, TwoStep&> {
    Elastostatic& solver = solver_of(w, object);
    return {solver, two_step_of(w, object)};
  };
  const Load& load = *object.shown.load;
  std::vector<double>& shape = object.shown.displacement.write();
  const bool changed = !object.shown.touches.empty() || acted_anew(object);
  ElastostaticYielding single([&]() -> Elastostatic& { return solver_of(w, object); }, load);
  if (part != nullptr && !part->part.known.empty())
    single.set_before(part->under);
  for (const ShortWay& way : short_ways(w, objects)) {
    const bool last = changed && way.last;
    if (object.warp) {
      WarpedYielding turning(
          object.model(), [&]() -> WarpedStatics& { return warped_of(w, object); }, load,
          object.contact->touches());
      object.contact->update(turning, load.displacement, way.instruments, shape, last);
      solved = solved && turning.solved();
      if (object.statics->warped)
        object.warped = object.statics->warped->answer();
    } else if (object.stages.options) {
      TwoStepYielding both(object.model(), stages, load);
      object.contact->update(both, load.displacement, way.instruments, shape, last);
      solved = solved && both.solved();
    } else {
      object.contact->update(single, load.displacement, way.instruments, shape, last,
                             part != nullptr ? &part->part : nullptr);
    }
    solved = solved && object.contact->solved();
  }
  if (part != nullptr)
    part->under = single.acting();
  w.now.counts.touches.add(object.contact->take_counts());
  object.shown.touches = object.contact->touches();
  object.shown.points = object.contact->points();
  settle_led(w, objects);
  if (const auto stuck = object.contact->stuck())
    tell_stuck(w, object, *stuck);
  if (!solved)
    warn_inexact(w, object);
}

/// Among the forces that are shown.
void add_touches(Object& object) {
  if (object.shown.touches.empty())
    return;
  std::vector<NodeVector>& forces = object.shown.forces.write();
  for (const NodeTouch& t : object.shown.touches) {
    const auto at =
        std::lower_bound(forces.begin(), forces.end(), t.node,
                         [](const NodeVector& v, std::uint32_t node) { return v.node < node; });
    if (at != forces.end() && at->node == t.node)
      at->value += t.force;
    else
      forces.insert(at, {t.node, t.force});
  }
}

} // namespace gewebe::simulation
