// The two-step method of elastostatic objects, and what both ways of finding a shape have in
// common.

#include "scene/rules_internal.h"

#include <utility>

namespace gewebe::simulation {

void update_stages(World& w, Object& object, const Load& load) {
  Elastostatic& still = still_of(w, object);
  if (!object.stages.options) {
    still.update(load);
    return;
  }
  std::optional<TwoStep>& two_step = object.statics->two_step;
  if (!two_step)
    two_step.emplace(object.model(), object.stages.second(), w.context, *object.stages.options,
                     w.options.tolerance);
  two_step->update(still, load);
}

std::span<const double> still_shape(Object& object) {
  Statics& statics = *object.statics;
  return statics.two_step ? statics.two_step->displacement(*statics.still)
                          : statics.still->displacement();
}

const std::vector<NodeVector>& still_forces(const Object& object) {
  const Statics& statics = *object.statics;
  return statics.two_step ? statics.two_step->contact_forces() : statics.still->contact_forces();
}

void Rule<SetTwoStep>::check(World& w, const SetTwoStep& c) {
  require_support(w, w.now.objects.at(c.object), Feature::two_step);
}

void Rule<SetTwoStep>::apply(World& w, const SetTwoStep& c) {
  Object& object = w.now.objects.at(c.object);
  if (object.statics->two_step) {
    object.statics->ahead = true;
    object.statics->two_step->set(c.options);
  }
  object.stages.options = c.options;
  if (!object.stages.second)
    object.stages.second = c.second;
  object.stages.warned = false;
  touch(object);
}

void Rule<SetTwoStep>::log(const World&, const SetTwoStep& c, ChangeRow& row) {
  row.what = "two-step";
  row.value = c.options.threshold;
  row.text = c.options.series ? "series" : "";
}

} // namespace gewebe::simulation
