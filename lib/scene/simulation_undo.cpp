// A step that fails leaves the state as it was: what it changes is noted while it is made.

#include "scene/simulation_internal.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

namespace gewebe {

/// Carried out last, when objects and bodies are those of before again.
void Simulation::open_undo() {
  undo_->open = true;
  struct ObjectNow {
    bool shown = false, warned_range = false;
    double looked_at = 0;
    int not_looked = 0;
    std::vector<NodeTouch> touches, impulses;
  };
  struct BodyNow {
    bool touched = false;
    std::optional<Box3> rest_box;
  };
  std::vector<ObjectNow> objects;
  for (const auto& o : objects_)
    objects.push_back(
        {o->shown, o->warned_range, o->looked_at, o->not_looked, o->touches, o->impulses});
  std::vector<BodyNow> bodies;
  for (const auto& b : bodies_)
    bodies.push_back({b->touched, b->rest_box});
  std::vector<Instrument> instruments;
  for (const auto& i : instruments_)
    instruments.push_back(*i);
  undo_->note([this, objects, bodies, instruments, poses = poses_, time = time_,
               shapes_time = shapes_time_, sum = sum_, lost = lost_, gravity = gravity_,
               timestep = timestep_, forces = emit_forces_, shapes = emit_shapes_,
               emits = emit_instruments_, counts = counts_, jumps = jumps_, ties = ties_.size(),
               cuttings = cuttings_] {
    time_ = time;
    shapes_time_ = shapes_time;
    sum_ = sum;
    lost_ = lost;
    gravity_ = gravity;
    timestep_ = timestep;
    emit_forces_ = forces;
    emit_shapes_ = shapes;
    emit_instruments_ = emits;
    counts_ = counts;
    jumps_ = jumps;
    cuttings_ = cuttings;
    ties_.resize(ties);
    poses_ = poses;
    for (std::size_t k = 0; k < instruments.size(); ++k)
      *instruments_[k] = instruments[k];
    for (std::size_t k = 0; k < objects.size(); ++k) {
      Object& o = *objects_[k];
      const ObjectNow& was = objects[k];
      o.shown = was.shown;
      o.warned_range = was.warned_range;
      o.looked_at = was.looked_at;
      o.not_looked = was.not_looked;
      o.touches = was.touches;
      o.impulses = was.impulses;
    }
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      bodies_[k]->touched = bodies[k].touched;
      bodies_[k]->rest_box = bodies[k].rest_box;
    }
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
    if (object.contact) // as it was, with what it touched
      object.contact =
          std::make_unique<StaticContact>(object.model, object.displacement, object.touches);
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

/// Of a body, before anything of it changes. One that rests keeps its place until it is woken, so
/// that rows are not copied for nothing.
void Simulation::keep_body(Body& body) {
  if (!undo_->open || undo_->kept.contains(&body))
    return;
  const bool rows = body.changed || !body.moving->resting();
  if (!(rows ? undo_->kept : undo_->kept_resting).insert(&body).second)
    return;
  undo_->note([&body, changed = body.changed, state = body.moving->state(rows)] {
    body.moving->restore(state);
    body.changed = changed;
    body.failure = nullptr;
  });
}

} // namespace gewebe
