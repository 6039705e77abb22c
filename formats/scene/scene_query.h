#pragma once
// What a scene answers to a question, as text: gewebe_serve(5).

#include "formats/scene/command.h"
#include "model/selector.h"
#include "scene/simulation.h"

#include <string>

namespace gewebe::formats {

/// The lines of the answer. A model that was not needed before is read for nodes and select;
/// nothing else changes. \throw Error if there is no such object, its shape was not computed or the
/// selector names nothing; what the object's model and `lists` throw
std::string text_query(const scene::Simulation& simulation, const QueryCommand& query,
                       const model::LoadNodeList& lists);

} // namespace gewebe::formats
