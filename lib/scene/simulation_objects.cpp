// Objects of a scene: what they consist of, read when it is needed.

#include "scene/simulation_internal.h"

#include <algorithm>
#include <memory>
#include <utility>

namespace gewebe {

void Simulation::insert(std::unique_ptr<Object> object) {
  for (const auto& other : objects_)
    if (other->name == object->name)
      throw Error("there is an object '" + object->name + "' already, expected another name");
  object->load.gravity = gravity_;
  object->shown = object->load.empty();
  objects_.push_back(std::move(object));
}

void Simulation::add_object(const std::string& name, ObjectSource source, Method method,
                            Integration integration) {
  auto object = std::make_unique<Object>();
  object->name = name;
  object->source = std::move(source);
  object->method = method;
  object->integration = integration;
  insert(std::move(object));
}

void Simulation::add_object(const std::string& name, Model model, Method method,
                            StiffnessParts parts, Integration integration) {
  auto object = std::make_unique<Object>();
  object->name = name;
  object->model = std::move(model);
  object->method = method;
  object->integration = integration;
  object->displacement.assign(3 * object->model.nodes.size(), 0);
  object->known = true;
  if (method == Method::ffe)
    object->still.emplace(object->model, std::move(parts), context_,
                          ElastostaticOptions{.measure_error = options_.measure_error,
                                              .tolerance = options_.tolerance});
  insert(std::move(object));
  if (method == Method::ffe)
    return;
  try {
    bodies_.push_back(make_body({objects_.size() - 1}));
  } catch (...) {
    objects_.pop_back();
    throw;
  }
}

void Simulation::need_model(Object& object) const {
  if (object.known)
    return;
  object.model = object.source.model();
  object.displacement.assign(3 * object.model.nodes.size(), 0);
  object.known = true;
}

/// An elastodynamic object has a body from when something first acts on it.
void Simulation::need_body(std::size_t object) {
  if (objects_[object]->body != nullptr)
    return;
  need_model(*objects_[object]);
  bodies_.push_back(make_body({object}));
  undo_->note([this, object] {
    const Body* const body = objects_[object]->body;
    objects_[object]->body = nullptr;
    std::erase_if(bodies_, [&](const auto& one) { return one.get() == body; });
  });
}

Elastostatic& Simulation::still_of(Object& object) const {
  need_model(object);
  if (object.still)
    return *object.still;
  if (undo_->open)
    undo_->updated.insert(&object);
  StiffnessParts parts;
  if (object.prepared)
    parts = *std::exchange(object.prepared, std::nullopt);
  else if (!object.first && object.source.stiffness)
    parts = object.source.stiffness(object.model);
  object.still.emplace(object.model, std::move(parts), context_,
                       ElastostaticOptions{.measure_error = options_.measure_error,
                                           .tolerance = options_.tolerance});
  return *object.still;
}

void Simulation::update_still(Object& object, const Load& load) {
  if (undo_->open)
    undo_->updated.insert(&object);
  update_stages(object, load);
}

} // namespace gewebe
