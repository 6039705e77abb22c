// Features that an object supports, from the table in support.h.

#include "scene/support.h"

#include "dynamics/solid_law.h"
#include "scene/world_internal.h"

#include <string>

namespace gewebe::scene {

namespace {

bool goes(const Object& object, Way way) {
  const bool moves = object.method == Method::ela;
  const bool implicit = object.integration == Integration::implicit;
  switch (way) {
  case Way::explicit_motion:
    return moves && !implicit;
  case Way::implicit_motion:
    return moves && implicit;
  case Way::attached:
    return object.body != nullptr && object.body->parts.size() > 1;
  case Way::elastostatic:
    return !moves;
  case Way::two_step:
    return object.stages.options.has_value();
  case Way::two_step_stored:
    return object.stages.options && object.stages.model == nullptr;
  case Way::whole:
    return object.cut.first == nullptr;
  case Way::cut:
    return object.cut.first != nullptr;
  case Way::solid:
    return object.matter->known && !object.model().tetrahedra.empty();
  case Way::sprung:
    return object.matter->known && is_solid(object) &&
           (!object.model().springs.empty() ||
            model::body_count(object.model()) != object.model().nodes.size());
  case Way::net:
    return object.matter->known && object.model().tetrahedra.empty();
  case Way::solid_motion:
    return moves && object.matter->known && is_solid(object);
  case Way::warped:
    return object.warp;
  case Way::strained:
    return !moves && has_law(object);
  case Way::viscoelastic:
    return object.matter->known && dynamics::is_viscoelastic(object.model());
  case Way::filled:
    return object.matter->solid.bulk.has_value();
  }
  return false;
}

/// One of those that an object is attached to.
const std::string& partner(const World& w, const Object& object) {
  const Object& first = w.now.objects[object.body->parts[0]];
  return &first == &object ? w.now.objects[object.body->parts[1]].name() : first.name();
}

} // namespace

const Gap* gap_of(const Object& object, Feature feature) {
  for (const Gap& one : gaps)
    if (one.feature == feature && goes(object, one.way))
      return &one;
  return nullptr;
}

void require_support(const World& w, const Object& object, Feature feature) {
  const Gap* const one = gap_of(object, feature);
  if (one == nullptr)
    return;
  std::string text(one->text);
  if (const std::size_t at = text.find('*'); at != std::string::npos)
    text.replace(at, 1, partner(w, object));
  throw Error("object " + object.name() + " " + text);
}

bool feels(const World& w, Object& object, Feature feature) {
  const Gap* const one = gap_of(object, feature);
  if (one == nullptr)
    return true;
  bool& told = object.matter->told.passed[static_cast<std::size_t>(feature)];
  if (!told && w.options.warn) {
    told = true;
    w.options.warn("object " + object.name() + " " + std::string(one->text));
  }
  return false;
}

} // namespace gewebe::scene
