#pragma once
// From commands of a scene to changes of its simulation: objects by number, selectors evaluated.

#include "formats/scene/command.h"
#include "model/selector.h"
#include "scene/simulation.h"

namespace gewebe::formats {

/// The change with the numbers of what the command names; a new instrument gets its number.
/// \throw Error if an object, instrument or node does not exist; what the object's model and
/// `lists` throw
scene::Change scene_change(const ChangeCommand& command, const scene::Simulation& simulation,
                           const model::LoadNodeList& lists);

} // namespace gewebe::formats
