#include "tools/cli/cli.h"

#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>
#include <utility>

namespace gewebe::cli {

struct Stats::State {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  nlohmann::ordered_json seconds = nlohmann::ordered_json::object();
  std::vector<std::pair<std::string, std::unique_ptr<Stats>>> objects;

  nlohmann::ordered_json whole() const {
    nlohmann::ordered_json all = json;
    for (const auto& [key, object] : objects)
      all[key] = object->state_->whole();
    if (!seconds.empty())
      all["seconds"] = seconds;
    return all;
  }
};

Stats::Stats() : state_(std::make_unique<State>()) {}
Stats::~Stats() = default;

void Stats::set(std::string_view key, std::uint64_t value) {
  state_->json[std::string(key)] = value;
}
void Stats::set(std::string_view key, std::int64_t value) {
  state_->json[std::string(key)] = value;
}
void Stats::set(std::string_view key, double value) {
  state_->json[std::string(key)] = value;
}
void Stats::set(std::string_view key, bool value) {
  state_->json[std::string(key)] = value;
}
void Stats::set(std::string_view key, std::string_view value) {
  state_->json[std::string(key)] = std::string(value);
}
void Stats::set(std::string_view key, const std::vector<double>& values) {
  state_->json[std::string(key)] = values;
}
void Stats::set(std::string_view key, const std::vector<std::uint64_t>& values) {
  state_->json[std::string(key)] = values;
}
void Stats::seconds(std::string_view key, double value) {
  auto& sum = state_->seconds[std::string(key)];
  sum = (sum.is_number() ? sum.get<double>() : 0.0) + value;
}

Stats& Stats::object(std::string_view key) {
  for (auto& [name, object] : state_->objects)
    if (name == key)
      return *object;
  return *state_->objects.emplace_back(key, std::make_unique<Stats>()).second;
}

std::string Stats::json() const {
  return state_->whole().dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

namespace {

std::string three_digits(double value) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

/// What is worth a line to people: numbers and words; not lists, objects and digests.
std::string figures_of(const nlohmann::ordered_json& all) {
  std::string text;
  for (const auto& [key, value] : all.items())
    if ((value.is_number() || value.is_boolean() || value.is_string()) && key != "tool" &&
        key.find("digest") == std::string::npos)
      text += (text.empty() ? "" : ", ") + key + " " +
              (value.is_string()         ? value.get<std::string>()
               : value.is_number_float() ? three_digits(value.get<double>())
                                         : value.dump());
  return text;
}

} // namespace

std::vector<std::string> Stats::figures() const {
  const nlohmann::ordered_json all = state_->whole();
  std::vector<std::string> lines{figures_of(all)};
  for (const auto& [key, value] : all.items())
    if (value.is_object() && key != "seconds")
      lines.push_back(key + ": " + figures_of(value));
  if (lines[0].empty())
    lines.erase(lines.begin());
  return lines;
}

} // namespace gewebe::cli
