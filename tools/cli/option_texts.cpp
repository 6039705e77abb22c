#include "tools/cli/options_internal.h"
#include "tools/cli/tool_list.h"

#include <nlohmann/json.hpp>

#include <array>
#include <utility>

namespace gewebe::cli {
namespace {

struct ExitStatus {
  int number;
  std::string_view meaning;
};
constexpr std::array exit_statuses{
    ExitStatus{0, "success"}, ExitStatus{1, "reading, working or writing failed"},
    ExitStatus{2, "wrong use: unknown option, missing operand, value out of range"}};

} // namespace

std::string CommandLine::help(const std::string& description) const {
  constexpr std::size_t column = 34;
  std::string text = description + "\nUsage: " + tool + " [OPTIONS]";
  for (const Operand& operand : operands) {
    const std::string name = operand.name + (operand.values != nullptr ? "..." : "");
    text += operand.min_count > 0 ? " " + name : " [" + name + "]";
  }
  const auto add_line = [&](const std::string& name, const std::string& help) {
    const std::size_t width = name.size() + 2;
    text += "  " + name + (width + 2 <= column ? "" : "\n") +
            std::string(width + 2 <= column ? column - width : column, ' ') + help + "\n";
  };
  text += "\n\nPositionals:\n";
  for (const Operand& operand : operands)
    add_line(operand.name + (operand.values != nullptr ? " ..." : "") +
                 (operand.min_count > 0 ? " REQUIRED" : ""),
             operand.help);
  text += "\nOptions:\n";
  for (const auto& spec : specs)
    add_line(spec->names + (spec->metavar.empty() ? "" : " " + spec->metavar) +
                 (spec->set_numbered ? " ..." : ""),
             spec->help +
                 (spec->default_text.empty() ? "" : " (default " + spec->default_text + ")"));
  if (const auto examples = tool_examples(tool); !examples.empty()) {
    text += "\nExamples:\n";
    for (const ToolExample& example : examples)
      ((((text += "  # ") += example.what) += "\n  ") += example.command) += "\n";
  }
  text += "\nExit status:\n";
  for (const ExitStatus& status : exit_statuses)
    ((text += "  " + std::to_string(status.number) + "  ") += status.meaning) += "\n";
  return text + "\n";
}

std::string CommandLine::help_json(const std::string& description) const {
  using Json = nlohmann::ordered_json;
  Json all{{"program", tool}, {"version", GEWEBE_VERSION}, {"description", description}};
  all["options"] = Json::array();
  for (const auto& spec : specs) {
    Json option{{"name", spec->long_name()}};
    if (spec->names[1] != '-')
      option["short"] = spec->names.substr(0, 2);
    option["help"] = spec->help;
    if (spec->set) {
      option["value"] = spec->metavar;
      option["type"] = spec->value_type;
      option["value_optional"] = spec->flag != nullptr;
      option["repeatable"] = static_cast<bool>(spec->set_numbered);
    }
    if (!spec->default_text.empty())
      option["default"] = spec->default_text;
    if (!spec->choices.empty())
      option["choices"] = spec->choices;
    if (spec->list_count != 0)
      option["count"] = spec->list_count;
    if (spec->must_be_positive)
      option["above"] = 0;
    if (spec->min)
      option["minimum"] = *spec->min;
    if (spec->max)
      option["maximum"] = *spec->max;
    all["options"].push_back(std::move(option));
  }
  all["operands"] = Json::array();
  for (const Operand& operand : operands) {
    Json json{{"name", operand.name},
              {"help", operand.help},
              {"minimum_count", operand.min_count},
              {"repeatable", operand.values != nullptr}};
    if (!operand.words.empty())
      json["choices"] = operand.words;
    all["operands"].push_back(std::move(json));
  }
  all["examples"] = Json::array();
  for (const ToolExample& example : tool_examples(tool))
    all["examples"].push_back({{"what", example.what}, {"command", example.command}});
  for (const ExitStatus& status : exit_statuses)
    all["exit_statuses"][std::to_string(status.number)] = status.meaning;
  return all.dump(2) + "\n";
}

std::string CommandLine::describe(const std::string& description) const {
  std::string text = "program\t" + tool + "\t\t\t" + description + "\n";
  const auto add = [&](const char* what, const std::string& names, const std::string& metavar,
                       const std::vector<std::string>& words, const std::string& help) {
    std::string list;
    for (const std::string& word : words)
      list += (list.empty() ? "" : " ") + word;
    text += std::string(what) + "\t" + names + "\t" + metavar + "\t" + list + "\t" + help + "\n";
  };
  for (const auto& spec : specs)
    add(spec->set ? "option" : "flag", spec->names, spec->metavar,
        spec->choices.empty() ? spec->proposals : spec->choices, spec->help);
  for (const Operand& operand : operands)
    add(operand.values != nullptr ? "operands" : "operand", operand.name, operand.name,
        operand.words, operand.help);
  return text;
}

} // namespace gewebe::cli
