// A step that fails leaves the state as it was: what it changes is noted while it is made.

#include "sim/simulation_internal.h"

#include <algorithm>
#include <utility>

namespace gewebe {

void Simulation::open_undo() {
  undo_->open = true;
  keep_instruments();
  undo_->note([this, time = time_, shapes_time = shapes_time_, sum = sum_, lost = lost_,
               gravity = gravity_, timestep = timestep_, forces = emit_forces_,
               shapes = emit_shapes_, counts = counts_, jumps = jumps_, ties = ties_.size(),
               cuttings = cuttings_] {
    time_ = time;
    shapes_time_ = shapes_time;
    sum_ = sum;
    lost_ = lost;
    gravity_ = gravity;
    timestep_ = timestep;
    emit_forces_ = forces;
    emit_shapes_ = shapes;
    counts_ = counts;
    jumps_ = jumps;
    cuttings_ = cuttings;
    ties_.resize(ties);
  });
}

/// What an elastostatic object keeps to be quick depends on the shapes that it took, so it is
/// renewed where one of them is taken back.
void Simulation::take_back() noexcept {
  undo_->open = false;
  for (; !undo_->back.empty(); undo_->back.pop_back())
    undo_->back.back()();
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    Object& object = *objects_[i];
    const bool implicit = object.body != nullptr && object.integration == Integration::implicit &&
                          undo_->kept.contains(object.body);
    if (!implicit && !undo_->updated.contains(&object))
      continue;
    renew(object);
    renewed_.push_back(i);
  }
  *undo_ = {};
}

/// Of an object, before it changes.
void Simulation::keep_load(Object& object) {
  if (undo_->open)
    undo_->note([&object, load = object.load, shown = object.shown, body = object.body,
                 changed = object.body != nullptr && object.body->changed] {
      object.load = load;
      object.shown = shown;
      if (body != nullptr)
        body->changed = changed;
    });
}

/// Of what moves, before it does.
void Simulation::keep_body(Body& body) {
  if (!undo_->open)
    return;
  if (undo_->kept.insert(&body).second)
    undo_->note([this, &body, changed = body.changed, state = body.moving->state()] {
      body.moving->restore(state);
      body.changed = changed;
      body.failure = nullptr;
      for (const std::size_t part : body.parts)
        objects_[part]->shown = false;
    });
  if (body.changed) // taken back before the motion is
    undo_->note(
        [&body, load = body.moving->load(), time = time_] { body.moving->set_load(load, time); });
}

} // namespace gewebe
