#include "model/material.h"

#include "base/error.h"

#include <algorithm>
#include <charconv>

namespace gewebe {

// Where the numbers come from. They set the order of magnitude; tissue varies by factors between
// people and, being non-linear, with its stretch.
//   density      soft tissue and liver about 1.06 g/cm3: ICRU Report 46, 1992
//   liver        5.5 kPa, healthy, transient elastography: Roulot et al., J Hepatol 48, 2008;
//                10 mm is no wall: it is the shell as heavy as the organ, for 1.5 kg on 0.15 m2
//   gallbladder  some hundred kPa in tension: Karimi et al., J Med Eng Technol 41, 2017;
//                a healthy wall is at most 3 mm thick in ultrasound
//   uterus       30 to 90 kPa in compression at 0.1 to 100 Hz: Kiss et al., Phys Med Biol 51, 2006;
//                the myometrium is one to two centimetres thick
// The damping ratio is a choice: motion dies within a few swings.
const std::vector<Material>& material_presets() {
  static const std::vector<Material> presets{
      {"generic", 1e-3, 1e4, 5, 0.2},
      {"liver", 1.06e-3, 5500, 10, 0.2},
      {"gallbladder", 1.06e-3, 2.5e5, 3, 0.2},
      {"uterus", 1.06e-3, 3e4, 15, 0.2},
  };
  return presets;
}

Material material_preset(std::string_view name) {
  std::string known;
  for (const Material& m : material_presets()) {
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
  }
}

MaterialChoice parse_material_choice(std::string_view text) {
  constexpr std::int32_t most_parts = 4096;
  MaterialChoice choice;
  choice.materials.push_back(material_preset("generic"));
  std::vector<bool> named;
  for (bool first = true;; first = false) {
    const std::size_t comma = std::min(text.find(','), text.size());
    const std::string_view word = text.substr(0, comma);
    const std::size_t sign = word.find('=');
    if (sign == std::string_view::npos) {
      if (!first)
        throw Error("surplus material '" + std::string(word) + "', expected PART=NAME");
      choice.materials[0] = material_preset(word);
    } else {
      std::int32_t part = -1;
      const auto [rest, status] = std::from_chars(word.data(), word.data() + sign, part);
      if (status != std::errc{} || rest != word.data() + sign || part < 0 || part >= most_parts)
        throw Error("no part '" + std::string(word.substr(0, sign)) + "', expected 0 to " +
                    std::to_string(most_parts - 1));
      const auto p = static_cast<std::size_t>(part);
      if (p >= named.size()) {
        named.resize(p + 1);
        choice.of_part.resize(p + 1);
      }
      if (named[p])
        throw Error("part " + std::to_string(part) + " has two materials, expected one");
      named[p] = true;
      const Material material = material_preset(word.substr(sign + 1));
      auto found = std::find(choice.materials.begin(), choice.materials.end(), material);
      if (found == choice.materials.end())
        found = choice.materials.insert(found, material);
      choice.of_part[p] = static_cast<std::int32_t>(found - choice.materials.begin());
    }
    if (comma == text.size())
      return choice;
    text.remove_prefix(comma + 1);
  }
}

} // namespace gewebe
