#pragma once
// The language of scenes, scene(5): one command a line.

#include "sim/command.h"

#include <optional>
#include <string_view>

namespace gewebe {

/// The command of one line (without its end), or nothing if it is blank or a comment. Syntax alone:
/// whether objects and files exist is for the run to find out.
/// \throw Error without place, what is wrong and what was expected
std::optional<Command> parse_scene_line(std::string_view line);

} // namespace gewebe
