// A call that fails leaves the scene as it was.

#include "scene/world_internal.h"

#include <cstddef>
#include <memory>
#include <utility>

namespace gewebe::simulation {

void Body::restore(const Snapshot& was) {
  changed = was.changed;
  step_parts = was.step_parts;
  rest_extents = was.rest_extents;
  moving->go_back(was.motion);
  failure = nullptr;
}

Saved saved_now(const World& w) {
  Saved saved{w.now, {}};
  for (const auto& body : w.now.bodies)
    saved.bodies.push_back(body->snapshot());
  return saved;
}

namespace {

/// The scene and its bodies.
void put_back(World& w, Saved&& saved) {
  w.now = std::move(saved.scene);
  for (std::size_t k = 0; k < saved.bodies.size(); ++k)
    w.now.bodies[k]->restore(saved.bodies[k]);
  for (Object& object : w.now.objects)
    if (object.matter->known && object.shown.displacement->empty()) // read meanwhile
      object.shown.displacement.replace().assign(3 * object.model().nodes.size(), 0);
}

} // namespace

Saved save(World& w) {
  for (const Object& object : w.now.objects)
    object.statics->ahead = false;
  for (const auto& body : w.now.bodies)
    body->ahead = false;
  w.saved = true;
  return saved_now(w);
}

void take_back_again(World& w, Saved&& saved) noexcept {
  put_back(w, std::move(saved));
}

/// Drops the caches of objects that have changed since the scene was saved. Caches depend on the
/// shapes that were computed.
void take_back(World& w, Saved&& saved) noexcept {
  put_back(w, std::move(saved));
  w.saved = false;
  for (std::size_t i = 0; i < w.now.objects.size(); ++i) {
    Object& object = w.now.objects[i];
    const bool ahead = object.body != nullptr && object.body->ahead && moves_implicitly(object);
    if (!ahead && !object.statics->ahead)
      continue;
    renew(object);
    w.renewed.push_back(i);
  }
}

} // namespace gewebe::simulation
