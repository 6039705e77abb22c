#pragma once
// The language of scenes, scene(5): one command a line.

#include "formats/scene/command.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

/// The command of one line (without its end), or nothing if it is blank or a comment. Syntax alone:
/// whether objects and files exist is for the run to find out.
/// \throw Error without place, what is wrong and what was expected
std::optional<Command> parse_scene_line(std::string_view line);

/// The words of a line without their quotes and the comment, and a line that has these words.
/// \throw Error without place
std::vector<std::string> scene_words(std::string_view line);
std::string scene_line(const std::vector<std::string>& words);

} // namespace gewebe::formats
