// The two-step method of elastostatic objects, and what both ways of finding a shape have in
// common.

#include "base/error.h"
#include "scene/simulation_internal.h"

#include <utility>

namespace gewebe {

using simulation::number_text;

void Simulation::set_two_step(Object& object, const SetTwoStep& set) {
  if (undo_->open && object.two_step)
    undo_->updated.insert(&object);
  undo_->note(
      [&object, stages = object.stages, second = object.second, warned = object.warned_threshold] {
        object.stages = stages;
        object.second = second;
        object.warned_threshold = warned;
        object.two_step.reset();
      });
  object.stages = set.options;
  if (!object.second)
    object.second = set.second;
  if (object.two_step)
    object.two_step->set(set.options);
  object.warned_threshold = false;
}

void Simulation::update_stages(Object& object, const Load& load) const {
  Elastostatic& still = still_of(object);
  if (!object.stages) {
    still.update(load);
    return;
  }
  if (!object.two_step)
    object.two_step.emplace(object.model, object.second(), context_, *object.stages,
                            options_.tolerance);
  object.two_step->update(still, load);
}

std::span<const double> Simulation::still_shape(Object& object) const {
  return object.two_step ? object.two_step->displacement(*object.still)
                         : object.still->displacement();
}

const std::vector<NodeVector>& Simulation::still_forces(const Object& object) const {
  return object.two_step ? object.two_step->contact_forces() : object.still->contact_forces();
}

void Simulation::warn_of_thresholds() {
  for (const auto& object : objects_) {
    if (!object->stages || object->warned_threshold)
      continue;
    const double largest = object->two_step ? object->two_step->largest() : 0;
    if (largest > object->stages->threshold)
      continue;
    object->warned_threshold = true;
    if (options_.warn)
      options_.warn("object " + object->name + ": its load never exceeded the threshold " +
                    number_text(object->stages->threshold) + " of two-step (" +
                    number_text(largest) + " at most), so the second stage had no effect");
  }
}

} // namespace gewebe
