#include "model/material.h"

#include "base/error.h"
#include "model/material_table.h"

#include <algorithm>
#include <charconv>
#include <optional>

namespace gewebe::model {

const std::vector<Material>& material_presets() {
  static const std::vector<Material> presets = parse_material_table(preset_table(), "presets");
  return presets;
}

Material material_named(std::string_view name, const std::vector<Material>& table) {
  std::string known;
  for (const Material& m : table) {
    if (m.name == name)
      return m;
    known += (known.empty() ? "" : ", ") + m.name;
  }
  throw Error("no material '" + std::string(name) + "', expected one of " + known);
}

void override_materials(std::vector<Material>& materials, const MaterialOverrides& values) {
  for (Material& m : materials) {
    m.density = values.density.value_or(m.density);
    m.young = values.young.value_or(m.young);
    m.thickness = values.thickness.value_or(m.thickness);
    m.damping_ratio = values.damping_ratio.value_or(m.damping_ratio);
    if (values.poisson)
      m.poisson = values.poisson;
    if (values.law)
      m.law = values.law;
    if (values.prony)
      m.prony = *values.prony;
  }
}

std::int32_t chosen_material(const MaterialChoice& choice, std::int32_t part) {
  const auto p = static_cast<std::size_t>(part);
  return part >= 0 && p < choice.of_part.size() ? choice.of_part[p] : 0;
}

namespace {

/// The first of the words, and whether there are more.
std::string listed(const std::vector<std::string>& words) {
  constexpr std::size_t told = 8;
  std::string list;
  for (std::size_t k = 0; k < std::min(words.size(), told); ++k)
    list += (k == 0 ? "" : ", ") + words[k];
  return (words.size() == 1 ? "expected " : "expected one of ") + list +
         (words.size() > told ? " ..." : "");
}

/// Gives a part its material. \return false if it has one
bool choose(MaterialChoice& choice, std::int32_t part, std::int32_t material) {
  const auto at = std::ranges::lower_bound(choice.named, part);
  if (at != choice.named.end() && *at == part)
    return false;
  choice.named.insert(at, part);
  const auto p = static_cast<std::size_t>(part);
  if (p >= choice.of_part.size())
    choice.of_part.resize(p + 1);
  choice.of_part[p] = material;
  return true;
}

constexpr std::int32_t max_parts = 4096;

/// Nothing of a word that is the name of a part. \throw Error for a number out of range
std::optional<std::int32_t> part_number(std::string_view word) {
  std::int32_t part = -1;
  const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), part);
  if (word.empty() || (rest == word.data() + word.size() &&
                       (status != std::errc{} || part < 0 || part >= max_parts)))
    throw Error("no part '" + std::string(word) + "', expected 0 to " +
                std::to_string(max_parts - 1) + ", or the name of one");
  return rest == word.data() + word.size() ? std::optional(part) : std::nullopt;
}

} // namespace

void number_parts(MaterialChoice& choice, std::span<const std::string> names) {
  for (const auto& [name, material] : choice.by_name) {
    bool there = false;
    for (std::size_t p = 0; p < names.size(); ++p) {
      if (names[p] != name)
        continue;
      there = true;
      if (p >= static_cast<std::size_t>(max_parts) ||
          !choose(choice, static_cast<std::int32_t>(p), material))
        throw Error("part " + std::to_string(p) + ", which is '" + name +
                    "', has two materials, expected one");
    }
    std::vector<std::string> known(names.begin(), names.end());
    std::ranges::sort(known);
    known.erase(std::ranges::unique(known).begin(), known.end());
    std::erase(known, "");
    if (!there)
      throw Error(
          "there is no part '" + name + "' to give a material, " +
          (known.empty() ? "expected its number, since parts have no names here" : listed(known)));
  }
  choice.by_name.clear();
}

void require_parts(const MaterialChoice& choice, std::span<const std::int32_t> parts) {
  std::vector<std::int32_t> there(parts.begin(), parts.end());
  if (there.empty())
    there.push_back(0);
  std::ranges::sort(there);
  there.erase(std::ranges::unique(there).begin(), there.end());
  for (const std::int32_t part : choice.named)
    if (!std::ranges::binary_search(there, part)) {
      std::vector<std::string> numbers;
      for (const std::int32_t number : there)
        numbers.push_back(std::to_string(number));
      throw Error("there is no part " + std::to_string(part) + " to give a material, " +
                  listed(numbers));
    }
}

MaterialChoice parse_material_choice(std::string_view text, const std::vector<Material>& table) {
  MaterialChoice choice;
  choice.materials.push_back(material_named("generic", table));
  for (bool first = true;; first = false) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string_view word = text.substr(0, comma);
    const std::size_t sign = word.find('=');
    if (sign == std::string_view::npos) {
      if (!first)
        throw Error("surplus material '" + std::string(word) + "', expected PART=NAME");
      choice.materials[0] = material_named(word, table);
    } else {
      const std::string_view part = word.substr(0, sign);
      const std::optional<std::int32_t> number = part_number(part);
      const Material material = material_named(word.substr(sign + 1), table);
      auto found = std::find(choice.materials.begin(), choice.materials.end(), material);
      if (found == choice.materials.end())
        found = choice.materials.insert(found, material);
      const auto of = static_cast<std::int32_t>(found - choice.materials.begin());
      if (!number)
        choice.by_name.emplace_back(part, of);
      else if (!choose(choice, *number, of))
        throw Error("part " + std::to_string(*number) + " has two materials, expected one");
    }
    if (comma == text.size())
      return choice;
    text.remove_prefix(comma + 1);
  }
}

} // namespace gewebe::model
