// A call that fails leaves the scene as it was.

#include "scene/world_internal.h"

#include <cstddef>
#include <utility>

namespace gewebe::scene {

void Body::restore(const Snapshot& was) {
  changed = was.changed;
  step_parts = was.step_parts;
  rest_extents = was.rest_extents;
  moving->go_back(was.motion);
  failure = nullptr;
}

Statics::Past Statics::past() const {
  return {.solver = solver ? solver->past() : nullptr,
          .two_step = two_step ? two_step->past() : nullptr,
          .warped = warped ? warped->answer() : nullptr,
          .strained = strained ? strained->answer() : nullptr};
}

void Statics::restore(const Past& past) {
  if (solver)
    solver->restore(*past.solver);
  if (two_step)
    two_step->restore(*past.two_step);
  if (warped)
    warped->restore(past.warped);
  if (strained)
    strained->restore(past.strained);
}

Snapshot snapshot(const World& w) {
  Snapshot snapshot{w.now, {}, {}};
  for (const auto& body : w.now.bodies)
    snapshot.bodies.push_back(body->snapshot());
  for (const Object& object : w.now.objects)
    snapshot.statics.push_back(object.statics.past());
  return snapshot;
}

void roll_back(World& w, Snapshot&& snapshot) noexcept {
  w.now = std::move(snapshot.scene);
  for (std::size_t k = 0; k < snapshot.bodies.size(); ++k)
    w.now.bodies[k]->restore(snapshot.bodies[k]);
  for (std::size_t i = 0; i < snapshot.statics.size(); ++i)
    w.now.objects[i].statics.restore(snapshot.statics[i]);
  for (Object& object : w.now.objects)
    if (object.matter->known && object.shown.displacement->empty()) // read meanwhile
      object.shown.displacement.replace().assign(3 * object.model().nodes.size(), 0);
}

} // namespace gewebe::scene
