#pragma once
// The programs of Gewebe, and which of them does what.

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::cli {

struct ToolExample {
  std::string_view what, command;
};

bool is_tool(std::string_view name);
std::vector<std::string> tool_names();
/// Examples for --help, empty for other names. Those of all programs, in the order of `tool_names`,
/// run one after the other in an empty folder.
std::span<const ToolExample> tool_examples(std::string_view name);
/// A line for each program: its name, and what it does.
std::string tool_list();
/// Advice for a task that no program is named after, empty for other words.
std::string_view way_to(std::string_view task);

} // namespace gewebe::cli
