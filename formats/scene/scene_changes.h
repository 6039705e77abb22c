#pragma once
// From commands of a scene to changes of its simulation: objects by number, selectors evaluated.

#include "model/selector.h"
#include "scene/command.h"
#include "scene/simulation.h"

#include <optional>

namespace gewebe {

/// What the command changes, or nothing if it is none that does.
/// \throw Error if an object or node does not exist; what the object's model and `lists` throw
std::optional<Change> scene_change(const Command& command, Simulation& simulation,
                                   const LoadNodeList& lists);

} // namespace gewebe
