// The two-step method of elastostatic objects.

#include "base/error.h"
#include "sim/simulation_internal.h"

namespace gewebe {

using simulation::number_text;

void Simulation::set_two_step(Object& object, const SetTwoStep& set) {
  if (object.two_step)
    object.two_step->set(set.options);
  else
    object.two_step.emplace(object.model, set.second(), context_, set.options, options_.tolerance);
  object.warned_threshold = false;
}

void Simulation::warn_of_thresholds() {
  for (const auto& object : objects_) {
    if (!object->two_step || object->warned_threshold ||
        object->two_step->largest() > object->two_step->threshold())
      continue;
    object->warned_threshold = true;
    if (options_.warn)
      options_.warn("object " + object->name + ": its load never exceeded the threshold " +
                    number_text(object->two_step->threshold()) + " of two-step (" +
                    number_text(object->two_step->largest()) +
                    " at most), so the second stage had no effect");
  }
}

} // namespace gewebe
