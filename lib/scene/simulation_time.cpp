// Time: steps through events, and what is shown at their end.

#include "scene/simulation_internal.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

namespace gewebe {

using simulation::largest_number;
using simulation::number_text;

namespace {

constexpr double strain_limit = 0.1, turn_limit = 0.2;
constexpr double same_time = 1e-9;  // of a step's length
constexpr double most_sizes = 1e6;  // of an object, that a node may be displaced by
constexpr int slow_enough = 10;     // updates in a row, the first ones read and factorise
constexpr double most_events = 1e6; // repeated ones in a step

std::string percent(double part) {
  return number_text(std::round(1000 * part) / 10) + " %";
}

} // namespace

void Simulation::step(double dt) {
  // Neumaier's sum: ten steps of 0.1 s end at 1 s.
  const double sum = sum_ + dt;
  if (!std::isfinite(sum))
    throw Error("a step of " + number_text(dt) + " s from " + number_text(time_) +
                " s, expected an end that is finite");
  const double lost = lost_ + (sum_ >= dt ? (sum_ - sum) + dt : (dt - sum) + sum_);
  guarded([&] { advance(std::max(sum + lost, time_)); });
  sum_ = sum;
  lost_ = lost;
}

void Simulation::step_to(double time) {
  if (!(time >= time_))
    throw Error("the time " + number_text(time) + " s is past, expected " + number_text(time_) +
                " s or later");
  guarded([&] { advance(time); });
  sum_ = time;
  lost_ = 0;
}

template <class Work>
void Simulation::at_object(const Object& object, Work&& work) const {
  try {
    work();
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw Error("object " + object.name + " at " + number_text(time_) +
                " s: " + (error.place().empty() ? "" : error.place() + ": ") + error.what());
  }
}

void Simulation::advance(double to) {
  require_few_events(to);
  const double start = time_;
  const double slack = same_time * (to - time_);
  const auto move_to = [&](double time) {
    move_bodies(time);
    time_ = std::max(time_, time);
  };
  const auto due = [&] { return !events_.empty() && events_.begin()->first <= to + slack; };
  if (undo_->open && due()) // a repeated one may come and go several times
    undo_->note([this, before = std::make_shared<std::multimap<double, Event>>(events_)] {
      std::swap(events_, *before);
    });
  while (due()) {
    move_to(std::min(events_.begin()->first, to));
    take_effect_first();
  }
  move_to(to);
  note_poses();
  take_touches(time_ - start);
  sweep_blades();
  for (std::size_t i = 0; i < objects_.size(); ++i)
    at_object(*objects_[i], [&] { find_free_motion(i); });
  for (const auto& object : objects_) {
    if (emit_shapes_)
      need_model(*object);
    if (!object->shown ||
        (object->method == Method::ffe && object->load.changes_until() > object->shown_time) ||
        touched_anew(*object))
      at_object(*object, [&] { show(*object); });
    if (!emit_shapes_ && !options_.shapes)
      continue;
    if (undo_->open && !object->shaped)
      undo_->updated.insert(object.get());
    shape(*object); // now, so that a failure is one of this step
  }
  if (poses_.size() > 1)
    poses_.erase(poses_.begin(), poses_.end() - 1);
  shapes_time_ = time_;
  if (emit_instruments_)
    require_bounded_instruments();
  tear();
  ++counts_.steps;
}

/// The first event stays among those that wait while it takes effect, so that its nodes are
/// followed as those of all others; where what it is about comes apart it becomes several.
void Simulation::take_effect_first() {
  events_.begin()->second.in_flight = true;
  const Change change = events_.begin()->second.change;
  apply(change);
  while (!events_.empty() && events_.begin()->second.in_flight) {
    Event event = std::move(events_.begin()->second);
    events_.erase(events_.begin());
    event.in_flight = false;
    if (!(event.period > 0))
      continue;
    ++event.round;
    const double next = event.origin + event.round * event.period;
    if (!(next > time_))
      throw Error("the period " + number_text(event.period) +
                  " s is lost in the rounding of the time, expected a longer one");
    events_.emplace(next, std::move(event));
  }
}

/// A step with more events than anybody waits for is refused before it begins.
void Simulation::require_few_events(double to) const {
  double count = 0;
  for (const auto& [time, event] : events_)
    if (event.period > 0 && time <= to)
      count += (to - time) / event.period;
  if (!(count <= most_events))
    throw Error("a step to " + number_text(to) + " s holds " + number_text(std::round(count)) +
                " repeated events, expected at most a million: a shorter step, or at every with a "
                "longer time");
}

void Simulation::show(Object& object) {
  if (object.body != nullptr || !object.load.empty())
    need_model(object);
  const bool near = object.method == Method::ffe && (object.contact || instruments_there());
  const bool meets = near && !object.stages;
  if (near && !meets && !object.warned_stages && options_.warn) {
    object.warned_stages = true;
    options_.warn("object " + object.name +
                  " follows two steps of stiffness: instruments don't touch it");
  }
  if (meets)
    shape_in_step(object); // that it comes from
  undo_->note([&object, shown = object.shown, shaped = object.shaped, time = object.shown_time,
               late = std::exchange(object.late, nullptr)] {
    std::swap(object.displacement, object.before);
    std::swap(object.forces, object.forces_before);
    object.late = late;
    object.shown = shown;
    object.shaped = shaped;
    object.shown_time = time;
  });
  std::swap(object.displacement, object.before);
  std::swap(object.forces, object.forces_before);
  leave_shown(object);
  object.forces.clear();
  if (meets) {
    object.displacement = object.before;
    object.shown_load = load_at(object.load, object.model, time_);
    follow_instruments(object);
    object.shaped = true;
    if (!object.warned_range)
      warn_of_range(object);
    if (object.still)
      object.forces = object.still->contact_forces();
  } else if (object.method == Method::ffe && (object.still || !object.load.empty())) {
    object.shown_load = load_at(object.load, object.model, time_);
    update_in_time(object);
    object.forces = still_forces(object);
    object.shaped = false; // until somebody asks for it
    // Who never asks is warned too, if the contacts alone may leave the range.
    double most = 0;
    for (const auto& [node, d] : object.shown_load.displacement)
      most = std::max({most, std::abs(d.x), std::abs(d.y), std::abs(d.z)});
    if (!object.warned_range && may_leave_range(object, most))
      shape(object);
  } else {
    object.displacement.assign(3 * object.model.nodes.size(), 0);
    object.shown_load = {};
    object.shaped = true;
    if (object.body != nullptr)
      show_motion(object);
  }
  add_touches(object);
  require_bounded(object);
  object.shown_time = time_;
  object.shown = true;
}

/// mm that a node may be displaced by: beyond it an object is not bent but has exploded.
double Simulation::displacement_limit(Object& object) const {
  if (object.size == 0) {
    Box3 box;
    for (const Node& node : object.model.nodes)
      box.add(node.position);
    object.size = box.empty() || !(box.longest_side() > 0) ? 1 : box.longest_side();
  }
  return std::min(most_sizes * object.size, largest_number);
}

/// \param displacement 3 n numbers, of a shape that is found now
void Simulation::require_bounded(Object& object, std::span<const double> displacement) const {
  const double most = displacement_limit(object);
  for (std::size_t k = 0; k < displacement.size(); ++k)
    if (!(std::abs(displacement[k]) <= most))
      throw Error("node " + std::to_string(k / 3) + " is displaced by over " + number_text(most) +
                  " mm, a million times the size of the object, expected a smaller load or "
                  "timestep");
}

void Simulation::require_bounded_instruments() const {
  for (std::size_t k = 0; k < instruments_.size(); ++k) {
    const InstrumentReport report = instrument(k);
    for (const Vec3& v : {report.force, report.torque})
      if (!(norm(v) <= largest_number))
        throw Error("the force on the instrument " + instruments_[k]->name +
                    " leaves single precision, expected a smaller load or timestep");
  }
}

/// What is shown of it.
void Simulation::require_bounded(Object& object) const {
  if (object.shaped)
    require_bounded(object, object.displacement);
  for (const NodeVector& f : object.forces)
    for (int a = 0; a < 3; ++a)
      if (!(std::abs(f.value[a]) <= largest_number))
        throw Error("the force at node " + std::to_string(f.node) +
                    " leaves single precision, expected a smaller load or timestep");
}

void Simulation::show_motion(Object& object) {
  const std::span<const NodeMotion> motion =
      object.body->moving->motion().subspan(object.offset, object.model.nodes.size());
  for (std::size_t i = 0; i < motion.size(); ++i)
    for (int a = 0; a < 3; ++a)
      object.displacement[3 * i + static_cast<std::size_t>(a)] = motion[i].displacement[a];
  for (const NodeVector& f : object.body->moving->contact_forces())
    if (f.node >= object.offset && f.node - object.offset < object.model.nodes.size())
      object.forces.push_back({f.node - static_cast<std::uint32_t>(object.offset), f.value});
}

void Simulation::update_in_time(Object& object) {
  const bool watched = options_.rate > 0 && options_.warn && !object.load.displacement.empty();
  if (!watched || object.slow == slow_enough) {
    update_still(object, object.shown_load);
    return;
  }
  const auto start = std::chrono::steady_clock::now();
  update_still(object, object.shown_load);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  object.slow = taken.count() * options_.rate > 1 ? object.slow + 1 : 0;
  if (object.slow == slow_enough)
    options_.warn("object " + object.name + " at " + number_text(time_) + " s: its " +
                  std::to_string(object.load.displacement.size()) +
                  " displaced nodes are too many for " + number_text(options_.rate) +
                  " steps a second, the last step took " +
                  number_text(std::round(1e6 * taken.count()) / 1e3) + " ms for it");
}

void Simulation::shape(Object& object) const {
  if (object.shaped)
    return;
  if (object.late) {
    at_object(object, [&] { find_late_shape(object); });
    return;
  }
  at_object(object, [&] {
    update_stages(object, object.shown_load); // as it is, but where a change of method looked ahead
    const std::span<const double> u = still_shape(object);
    require_bounded(object, u);
    object.displacement.assign(u.begin(), u.end());
  });
  object.shaped = true;
  if (!object.warned_range)
    warn_of_range(object);
}

/// During a step, which may be taken back: the shape is then computed anew.
void Simulation::shape_in_step(Object& object) {
  if (undo_->open && !object.shaped) {
    undo_->updated.insert(&object);
    undo_->note([&object, late = object.late] {
      object.shaped = false;
      object.late = late;
    });
  }
  shape(object);
}

/// Whether it is worth to look at all edges where the largest displacement is this (mm).
bool Simulation::may_leave_range(Object& object, double most) const {
  if (object.shortest_edge == 0)
    object.shortest_edge = shortest_edge(object.model);
  // Ends that move less than this against each other can do no harm; beyond, a look at all edges
  // would cost as much as the shape, so not every time.
  return !(2 * std::sqrt(3.0) * most <= strain_limit * object.shortest_edge) &&
         (!(most <= 1.02 * object.looked_at) || ++object.not_looked >= 64);
}

void Simulation::warn_of_range(Object& object) const {
  // The range can be left only where something moves far.
  double most = 0;
  for (const double u : object.displacement)
    most = std::max(most, std::abs(u));
  if (!may_leave_range(object, most))
    return;
  object.looked_at = most;
  object.not_looked = 0;
  const LinearRange range = linear_range(object.model, object.displacement);
  const bool strained = !(range.strain <= strain_limit), turned = !(range.turn <= turn_limit);
  if (!strained && !turned)
    return;
  object.warned_range = true;
  const auto& tell = options_.distrust ? options_.distrust : options_.warn;
  if (!tell)
    return;
  const Spring& spring = object.model.springs[strained ? range.strain_spring : range.turn_spring];
  tell("object " + object.name + " at " + number_text(time_) +
       " s: beyond the linear range, the edge " + std::to_string(spring.i) + "-" +
       std::to_string(spring.j) +
       (strained ? " is strained by " + percent(range.strain)
                 : " is turned by " + percent(range.turn)) +
       ", the shape is not to be trusted there");
}

} // namespace gewebe
