#include "tools/cli/starter_texts.h"

#include "tools/cli/tool_list.h"

#include <nlohmann/json.hpp>

#include <array>
#include <string_view>

namespace gewebe::cli {
namespace {

constexpr std::string_view description = "Starts the programs of Gewebe.";

constexpr std::string_view usage = R"(
Usage: gewebe PROGRAM [ARGUMENT...]
       gewebe plot --y NAME,... [OPTION...] [TABLE]
       gewebe help [PAGE]
       gewebe --list | --makefile | --help | --help-json | --version
)";

struct Entry {
  std::string_view name, what;
};

constexpr std::array options{
    Entry{"--list", "the programs, and what they do"},
    Entry{"--makefile", "a Makefile from a scan, mesh or particles to a solid, a run and a film"},
    Entry{"-h,--help", "this text"},
    Entry{"--help-json", "print options, examples and exit statuses as JSON"},
    Entry{"--version", "version, commit, libraries, kernels"}};

constexpr std::array operands{
    Entry{"PROGRAM", "a program of --list, plot, or help"},
    Entry{"ARGUMENT", "arguments of the program, or a page of the manual"}};

constexpr std::array examples{
    ToolExample{"a sphere of 40 mm as a mesh",
                "echo 0 0 0 40 | gewebe metaball2vol --voxel 2 | gewebe mc-opt -o sphere.ply"},
    ToolExample{"a Makefile for the whole chain", "gewebe --makefile > Makefile"},
    ToolExample{"the page of scenes", "gewebe help scene"}};

constexpr std::array statuses{Entry{"0", "success"}, Entry{"1", "a program cannot be run"},
                              Entry{"2", "there is no program of that name"}};

} // namespace

std::string starter_help() {
  std::string text = std::string(description) + std::string(usage) + "\nOptions:\n";
  const auto add = [&](std::string_view name, std::size_t column, std::string_view what) {
    text += "  " + std::string(name);
    ((text += std::string(column - name.size(), ' ')) += what) += "\n";
  };
  for (const Entry& option : options)
    add(option.name, 14, option.what);
  text += "\nExamples:\n";
  for (const ToolExample& example : examples)
    ((((text += "  # ") += example.what) += "\n  ") += example.command) += "\n";
  text += "\nExit status, if not that of the program:\n";
  for (const Entry& status : statuses)
    add(status.name, 3, status.what);
  return text + "\n" + tool_list();
}

std::string starter_help_json() {
  using Json = nlohmann::ordered_json;
  Json all{{"program", "gewebe"}, {"version", GEWEBE_VERSION}, {"description", description}};
  for (const Entry& entry : options) {
    const std::size_t comma = entry.name.find(',');
    Json option{{"name", entry.name.substr(comma == std::string_view::npos ? 0 : comma + 1)}};
    if (comma != std::string_view::npos)
      option["short"] = entry.name.substr(0, comma);
    option["help"] = entry.what;
    all["options"].push_back(std::move(option));
  }
  for (const Entry& operand : operands)
    all["operands"].push_back({{"name", operand.name},
                               {"help", operand.what},
                               {"minimum_count", operand.name == "PROGRAM" ? 1 : 0},
                               {"repeatable", operand.name != "PROGRAM"}});
  for (const ToolExample& example : examples)
    all["examples"].push_back({{"what", example.what}, {"command", example.command}});
  for (const Entry& status : statuses)
    all["exit_statuses"][std::string(status.name)] = status.what;
  return all.dump(2) + "\n";
}

} // namespace gewebe::cli
