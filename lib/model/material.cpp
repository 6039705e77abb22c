#include "model/material.h"

#include "base/error.h"
#include "model/material_table.h"

#include <algorithm>
#include <charconv>

namespace gewebe {

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
  }
}

std::int32_t chosen_material(const MaterialChoice& choice, std::int32_t part) {
  const auto p = static_cast<std::size_t>(part);
  return part >= 0 && p < choice.of_part.size() ? choice.of_part[p] : 0;
}

void require_parts(const MaterialChoice& choice, std::span<const std::int32_t> parts) {
  std::vector<std::int32_t> there(parts.begin(), parts.end());
  if (there.empty())
    there.push_back(0);
  std::ranges::sort(there);
  there.erase(std::ranges::unique(there).begin(), there.end());
  for (const std::int32_t part : choice.named)
    if (!std::ranges::binary_search(there, part)) {
      constexpr std::size_t told = 8;
      std::string list;
      for (std::size_t k = 0; k < std::min(there.size(), told); ++k)
        list += (k == 0 ? "" : ", ") + std::to_string(there[k]);
      throw Error("there is no part " + std::to_string(part) + " to give a material, expected " +
                  (there.size() == 1 ? "" : "one of ") + list +
                  (there.size() > told ? " ..." : ""));
    }
}

MaterialChoice parse_material_choice(std::string_view text, const std::vector<Material>& table) {
  constexpr std::int32_t max_parts = 4096;
  MaterialChoice choice;
  choice.materials.push_back(material_named("generic", table));
  std::vector<bool> named;
  for (bool first = true;; first = false) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string_view word = text.substr(0, comma);
    const std::size_t sign = word.find('=');
    if (sign == std::string_view::npos) {
      if (!first)
        throw Error("surplus material '" + std::string(word) + "', expected PART=NAME");
      choice.materials[0] = material_named(word, table);
    } else {
      std::int32_t part = -1;
      const auto [rest, status] = std::from_chars(word.data(), word.data() + sign, part);
      if (status != std::errc{} || rest != word.data() + sign || part < 0 || part >= max_parts)
        throw Error("no part '" + std::string(word.substr(0, sign)) + "', expected 0 to " +
                    std::to_string(max_parts - 1));
      const auto p = static_cast<std::size_t>(part);
      if (p >= named.size()) {
        named.resize(p + 1);
        choice.of_part.resize(p + 1);
      }
      if (named[p])
        throw Error("part " + std::to_string(part) + " has two materials, expected one");
      named[p] = true;
      const Material material = material_named(word.substr(sign + 1), table);
      auto found = std::find(choice.materials.begin(), choice.materials.end(), material);
      if (found == choice.materials.end())
        found = choice.materials.insert(found, material);
      choice.of_part[p] = static_cast<std::int32_t>(found - choice.materials.begin());
    }
    if (comma == text.size()) {
      for (std::size_t p = 0; p < named.size(); ++p)
        if (named[p])
          choice.named.push_back(static_cast<std::int32_t>(p));
      return choice;
    }
    text.remove_prefix(comma + 1);
  }
}

} // namespace gewebe
