#pragma once
// Warnings of instruments that are small beside the cells of the surface that they touch.

#include "scene/simulation.h"

#include <functional>
#include <string>
#include <vector>

namespace gewebe::cli {

/// Looks once at each sphere and capsule, when it first touches a solid.
class InstrumentCheck {
public:
  /// Call it after a step. `warn` gets an instrument whose radius is below twice the median edge of
  /// the elements' faces under it, with the option of exp2ela that makes them small enough.
  void look(const scene::Simulation& simulation,
            const std::function<void(const std::string&)>& warn);

private:
  std::vector<bool> done_; ///< by instrument
};

} // namespace gewebe::cli
