// Time: steps through events.

#include "scene/rules_internal.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace gewebe::scene {

namespace {

constexpr double same_time = 1e-9; // of a step's length
constexpr double max_events = 1e6; // repeated ones in a step

/// Refuses a step with too many events before it begins.
void require_few_events(const World& w, double to) {
  double count = 0;
  for (const auto& [time, event] : *w.now.events)
    if (event.period > 0 && time <= to)
      count += (to - time) / event.period;
  if (!(count <= max_events))
    throw Error("a step to " + text::number_text(to) + " s holds " +
                text::number_text(std::round(count)) +
                " repeated events, expected at most a million: a shorter step, or at every with a "
                "longer time");
}

/// The first event stays among those that wait while it takes effect, so that its nodes are
/// followed as those of all others; where what it is about comes apart it becomes several.
void take_effect_first(World& w) {
  Event& first = w.now.events.write().begin()->second;
  first.in_flight = true;
  const Change change = first.change;
  apply(w, change);
  std::multimap<double, Event>& events = w.now.events.write();
  while (!events.empty() && events.begin()->second.in_flight) {
    Event event = std::move(events.begin()->second);
    events.erase(events.begin());
    event.in_flight = false;
    if (!(event.period > 0))
      continue;
    ++event.round;
    const double next = event.origin + event.round * event.period;
    if (!(next > w.now.clock.time))
      throw Error("the period " + text::number_text(event.period) +
                  " s is lost in the rounding of the time, expected a longer one");
    events.emplace(next, std::move(event));
  }
}

void require_bounded_instruments(const World& w) {
  for (std::size_t k = 0; k < w.now.instruments.size(); ++k) {
    const InstrumentReport report = report_of(w, k);
    for (const Vec3& v : {report.force, report.torque})
      if (!(norm(v) <= largest_number))
        throw Error("the force on the instrument " + w.now.instruments[k].name +
                    " leaves single precision, expected a smaller load or timestep");
  }
}

bool needs_showing(const World& w, const Object& object) {
  return !object.shown.valid || (relaxes(object) && w.now.clock.time > object.shown.time) ||
         (object.method == Method::ffe && object.load->changes_until() > object.shown.time);
}

/// Now, so that a failure is one of this step.
void find_shapes(World& w, Object& object) {
  if (w.now.settings.emits.any_shapes() || w.options.shapes)
    shape(w, object);
  if (w.now.settings.emits.shapes || w.options.shapes)
    (void)whole_shape(w, object);
}

void verify_shapes(World& w) {
  if (!w.options.verify_shapes)
    return;
  for (Object& object : w.now.objects)
    if (object.method == Method::ffe && !object.warp && !object.shown.deferred) {
      if (!object.shown.shaped && object.statics.solver)
        at_object(w, object, [&] { update_stages(w, object, acting_load(object.shown)); });
      verify_shape(object);
    }
}

void show_all(World& w) {
  const std::vector<std::uint8_t> in_contact = show_static_contacts(w);
  for (std::size_t number = 0; number < w.now.objects.size(); ++number) {
    Object& object = w.now.objects[number];
    if (w.now.settings.emits.any_shapes())
      need_model(object);
    if (object.in_motion)
      at_object(w, object, [&] { show_in_motion(w, object); });
    else if (in_contact[number] == 0 && needs_showing(w, object))
      at_object(w, object, [&] { show(w, object); });
    find_shapes(w, object);
  }
}

/// Viscoelastic solids at rest come to the time of an event under what acted before.
void relax_until_event(World& w) {
  for (Object& object : w.now.objects) {
    if (object.method != Method::ffe || object.in_motion || object.load->empty())
      continue;
    need_model(object);
    if (relaxes(object) && object.touching.empty() && !is_held_altogether(object))
      at_object(w, object, [&] { update_solver(w, object, acting_at(object, w.now.clock.time)); });
  }
  w.now.clock.changed = w.now.clock.time;
}

} // namespace

void advance(World& w, double to) {
  require_few_events(w, to);
  begin_contact(w);
  Clock& clock = w.now.clock;
  const double start = clock.time;
  clock.changed = start;
  const double slack = same_time * (to - start);
  const auto move_to = [&](double time) {
    advance_bodies(w, time);
    clock.time = std::max(clock.time, time);
  };
  while (!w.now.events->empty() && w.now.events->begin()->first <= to + slack) {
    move_to(std::min(w.now.events->begin()->first, to));
    relax_until_event(w);
    take_effect_first(w);
  }
  move_to(to);
  note_poses(w);
  end_contact(w, clock.time - start);
  sweep_blades(w);
  for (std::size_t i = 0; i < w.now.objects.size(); ++i)
    at_object(w, w.now.objects[i], [&] { find_free_motion(w, i); });
  show_all(w);
  verify_shapes(w);
  if (w.now.poses.size() > 1)
    w.now.poses.erase(w.now.poses.begin(), w.now.poses.end() - 1);
  clock.shown = clock.time;
  if (w.now.settings.emits.instruments)
    require_bounded_instruments(w);
  tear(w);
  ++w.now.counts.steps;
}

} // namespace gewebe::scene
