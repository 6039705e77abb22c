// Objects of a scene: what they consist of, read when it is needed.

#include "dynamics/solid_law.h"
#include "scene/world_internal.h"

#include <memory>
#include <optional>
#include <utility>

namespace gewebe::scene {

void insert(World& w, Object object) {
  for (const Object& other : w.now.objects)
    if (other.name() == object.name())
      throw Error("there is an object '" + object.name() + "' already, expected another name");
  object.load.write().gravity = w.now.gravity;
  object.shown.valid = object.load->empty();
  w.now.objects.push_back(std::move(object));
}

std::optional<integrator::SolidLaw> law_of(const Object& object) {
  const std::optional<integrator::SolidLaw>& chosen = object.matter->solid.law;
  return object.matter->known ? gewebe::dynamics::law_of(object.model(), chosen) : chosen;
}

namespace {

/// Laws of materials are known only when the model is read. \throw Error naming the object
void require_law_served(const Object& object) {
  std::optional<integrator::SolidLaw> law;
  try {
    law = gewebe::dynamics::law_of(object.model(), object.matter->solid.law);
  } catch (const Error& error) {
    throw ObjectError("object " + object.name() + ": " + error.what());
  }
  if (!law || object.method != Method::ffe || !(object.warp || object.stages.options))
    return;
  throw ObjectError("object " + object.name() + " has a law of large strains, which " +
                    (object.warp ? "rotation=warp" : "two-step") + " does not serve, expected no " +
                    (object.warp ? "rotation=warp" : "two-step") + " or a model without laws");
}

} // namespace

bool relaxes(const Object& object) {
  return object.method == Method::ffe && object.matter->known &&
         dynamics::is_viscoelastic(object.model());
}

dynamics::RestTime rest_time(const World& w, const Object& object, double end) {
  return {w.now.clock.changed, end, object.load->changes_until() > w.now.clock.shown};
}

void need_model(Object& object) {
  if (object.matter->known)
    return;
  object.matter->model = std::make_shared<const model::Model>(object.matter->source.model());
  require_law_served(object);
  object.shown.displacement.replace().assign(3 * object.model().nodes.size(), 0);
  object.matter->known = true;
}

} // namespace gewebe::scene
