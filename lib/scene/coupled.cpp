// Instruments that hands lead through a spring (contact/coupling.h). One gives way to a single
// object in the course of a step, or to the body that the object is part of: the one that pushed it
// most in the last step, or else one that it comes near to. The others meet it where it goes, and
// what they push it with counts from the next step on.

#include "scene/world_internal.h"

#include <algorithm>
#include <cmath>

namespace gewebe::simulation {

namespace {

/// An object that it is about to meet.
std::optional<std::size_t> near_object(const World& w, const Instrument& i, const Pose& end,
                                       Extents& extents) {
  if (w.now.objects.size() == 1)
    return 0;
  Box3 box = PlacedInstrument(i.shape, i.pose(w.now.clock.time)).box();
  const Box3 there = PlacedInstrument(i.shape, end).box();
  box.add(there.min);
  box.add(there.max);
  for (std::size_t k = 0; k < w.now.objects.size(); ++k) {
    if (w.now.objects[k].matter->known && near(extents.of(k).box, box, i.shape.radius))
      return k;
  }
  return std::nullopt;
}

bool is_led(const Instrument& i) {
  return i.present && i.coupled;
}

Vec3 force_of(const Object& object, std::size_t instrument) {
  Vec3 sum;
  for (const NodeTouch& t : object.shown.touches)
    sum -= t.instrument == instrument ? t.force : Vec3{};
  return sum;
}

} // namespace

/// Before a way to `to`: where each will be if it feels what it felt.
void lead_on(World& w, double to, Extents& extents) {
  const double duration = to - w.now.clock.time;
  for (Instrument& i : w.now.instruments) {
    if (!is_led(i))
      continue;
    Instrument::Coupled& c = *i.coupled;
    c.end = i.way.at(to);
    const Vec3 guess = c.led.guess(c.end.place, duration);
    const bool rests = norm(guess - c.led.place) <= led_to_rest * i.shape.radius;
    c.end.place = rests ? c.led.place : guess;
    if (!c.giver)
      c.giver = near_object(w, i, c.end, extents);
  }
}

/// Behind it: where bodies have left them, or as far as was known.
void follow_hands(World& w, double to) {
  const double duration = to - w.now.clock.time;
  for (std::size_t k = 0; k < w.now.instruments.size(); ++k) {
    Instrument& i = w.now.instruments[k];
    if (!is_led(i))
      continue;
    Instrument::Coupled& c = *i.coupled;
    const Body* const body = c.giver ? body_of(w.now.objects[*c.giver]) : nullptr;
    const std::optional<LedInstrument> led =
        body != nullptr && body->taken > 0 ? body->moving->led(k) : std::nullopt;
    if (led) {
      c.led = *led;
      continue;
    }
    const bool rests = c.end.place == c.led.place;
    const Vec3 place = c.led.place;
    c.led.settle(i.way.at(to).place, duration, c.led.force);
    if (rests)
      c.led.place = place;
  }
}

bool gives_way_to(const World& w, const Instrument& i, const Object& object) {
  if (!is_led(i) || !i.coupled->giver)
    return false;
  const Object& giver = w.now.objects[*i.coupled->giver];
  const Body* const body = body_of(giver);
  return &giver == &object || (body != nullptr && body == body_of(object));
}

/// The last part of an instrument's way in a step of the scene, as the elastostatic object meets it
/// that it gives way to.
MovedInstrument led_here(const World& w, const Instrument& i, const MovedInstrument& way) {
  const LedInstrument& shown = i.coupled->shown;
  const double h = w.now.clock.time - w.now.clock.shown;
  MovedInstrument led = way;
  led.now = i.way.at(w.now.clock.time);
  led.now.place = shown.guess(led.now.place, h);
  led.compliance = CouplingStep(shown.coupling, shown.lag, h).compliance;
  led.pushed = shown.force;
  return led;
}

/// Behind that: where it has gone.
void settle(World& w, std::size_t instrument, std::span<Object* const> objects) {
  Instrument& i = w.now.instruments[instrument];
  LedInstrument& led = i.coupled->led;
  led = i.coupled->shown;
  Vec3 force;
  for (const Object* const object : objects)
    force += force_of(*object, instrument);
  led.settle(i.way.at(w.now.clock.time).place, w.now.clock.time - w.now.clock.shown, force);
  i.before = i.pose(w.now.clock.time);
  w.now.poses.back()[instrument] = i.before;
}

/// At the end of a step of the scene: whom each gives way to in the next one.
void end_leading(World& w) {
  for (std::size_t k = 0; k < w.now.instruments.size(); ++k) {
    Instrument& i = w.now.instruments[k];
    if (!is_led(i))
      continue;
    Instrument::Coupled& c = *i.coupled;
    // The mean over a step counts where objects move, but for the one that it gives way to, which
    // knows its last.
    Vec3 all;
    std::optional<std::size_t> strongest;
    double most = 0;
    for (std::size_t o = 0; o < w.now.objects.size(); ++o) {
      const Vec3 force = force_of(w.now.objects[o], k);
      all += force;
      if (norm(force) > most) {
        most = norm(force);
        strongest = o;
      }
    }
    const auto of_body = [&](std::size_t object) {
      Vec3 sum;
      for (std::size_t o = 0; o < w.now.objects.size(); ++o)
        if (as_one(w, object, o))
          sum += force_of(w.now.objects[o], k);
      return sum;
    };
    const bool same = strongest && c.giver && gives_way_to(w, i, w.now.objects[*strongest]);
    if (!strongest)
      c.led.force = c.led.others = {};
    else if (!same || body_of(w.now.objects[*strongest]) == nullptr)
      c.led.force = of_body(*strongest);
    if (strongest)
      c.led.others = all - of_body(*strongest);
    c.giver = strongest;
    c.shown = c.led;
  }
}

} // namespace gewebe::simulation
