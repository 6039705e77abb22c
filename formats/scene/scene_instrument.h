#pragma once
// The commands of a scene that are about instruments, and their answer.

#include "model/selector.h"
#include "scene/command.h"
#include "scene/simulation.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace gewebe {

/// What a command about instruments changes, or nothing if it is about others; a new instrument
/// gets its number. \throw Error if an object or instrument does not exist; as `nodes`
std::optional<Change> instrument_change(
    const Command& command, Simulation& simulation,
    const std::function<std::vector<std::uint32_t>(std::size_t, const Selector&)>& nodes);

/// The lines of `emit instruments`, scene(5).
std::string instrument_reply(const Simulation& simulation);

} // namespace gewebe
