#pragma once
// From commands of a scene to changes of its simulation: objects by number, selectors evaluated.

#include "formats/scene/command.h"
#include "model/selector.h"
#include "scene/simulation.h"

namespace gewebe {

/// The change with the numbers of what the command names; a new instrument gets its number.
/// \throw Error if an object, instrument or node does not exist; what the object's model and
/// `lists` throw
Change scene_change(const ChangeCommand& command, const Simulation& simulation,
                    const LoadNodeList& lists);

} // namespace gewebe
