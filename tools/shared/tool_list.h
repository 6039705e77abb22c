#pragma once
// The programs of Gewebe, and which of them does what.

#include <string>
#include <string_view>
#include <vector>

namespace gewebe {

bool is_tool(std::string_view name);
std::vector<std::string> tool_names();
/// A line for each program: its name, and what it does.
std::string tool_list();
/// What does a task that no program is named after; nothing for other words.
std::string_view way_to(std::string_view task);

} // namespace gewebe
