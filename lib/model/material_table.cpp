#include "model/material_table.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>

namespace gewebe::model {

namespace {

constexpr std::string_view presets =
    R"(# Materials: name, density in g/mm3, Young's modulus in Pa, thickness in mm, damping ratio, Poisson's
# ratio.
#
# They set the order of magnitude; tissue varies by factors between people and, being non-linear,
# with its stretch. The damping ratio is a choice: motion dies within a few swings.
#
# Poisson's ratio: soft tissue is full of water and hardly changes its volume (Fung, Biomechanics:
# Mechanical Properties of Living Tissues, 1993); 0.49 leaves it some.
#
# Soft, and as heavy as water.
generic      0.001    10000   5  0.2  0.49
# Density: ICRU Report 46, 1992. Young's modulus: healthy, by transient elastography, Roulot et al.,
# J Hepatol 48, 2008. 10 mm is no wall but the shell that is as heavy as the organ, for 1.5 kg on
# 0.15 m2.
liver        0.00106   5500  10  0.2  0.49
# Some hundred kPa in tension: Karimi et al., J Med Eng Technol 41, 2017. A healthy wall is at most
# 3 mm thick in ultrasound. Density as of the liver.
gallbladder  0.00106 250000   3  0.2  0.49
# 30 to 90 kPa in compression at 0.1 to 100 Hz: Kiss et al., Phys Med Biol 51, 2006. The myometrium
# is one to two centimetres thick. Density as of the liver.
uterus       0.00106  30000  15  0.2  0.49
# Densities below that name no other source: ICRU Report 46, 1992.
# Cortex 5.0, standard deviation 2.9 kPa, by shear waves in 127 healthy people: Arda et al., AJR 197,
# 2011.
kidney       0.00105   5000  10  0.2  0.49
# 18.1, standard deviation 3.1 kPa, by shear waves in 100 healthy people: Giuffre et al., Ann Hepatol
# 18, 2019. (Arda et al. found 2.9 kPa by another device.)
spleen       0.00106  18000  10  0.2  0.49
# Inflated. Shear stiffness 1.1 kPa at residual volume and 1.8 kPa at total capacity, by magnetic
# resonance in 10 healthy people: Mariappan et al., J Magn Reson Imaging 33, 2011; 1.4 kPa is taken.
# Poisson's ratio of dogs' lobes: Lai-Fook et al., J Appl Physiol 40, 1976.
lung         0.00026   4000  10  0.2  0.43
# An artery's wall. Shear modulus of the hepatic artery 210 kPa, density 1.05 g/cm3: Mancia et al.,
# Phys Med Biol 64, 2019, from measurements of others. A wall of 1 mm is a choice.
vessel       0.00105 630000   1  0.2  0.49
# The wall, stretched: 1 to 4.1 MPa in tension to failure: Martins et al., Int Urogynecol J 22, 2011.
# One that is half full yields far more easily. Density as of muscle.
bladder      0.00105 1900000  3  0.2  0.49
# At rest, gastrocnemius: 11.1, standard deviation 4.1 kPa, by shear waves: Arda et al., as above.
muscle       0.00105  11000  10  0.2  0.49
# 3.25, standard deviation 0.9 kPa, of the breast: Samani et al., Phys Med Biol 52, 2007.
fat          0.00095   3200  10  0.2  0.49
# 56, standard deviation 16 kPa, over the breast by suction in vivo: Briot et al., Clin Biomech 99,
# 2022. Torsion finds 0.4 MPa and more: Agache et al., Arch Dermatol Res 269, 1980.
skin         0.00109  56000   2  0.2  0.49
# An invasive ductal carcinoma of high grade: 42, standard deviation 12 kPa: Samani et al., as above.
# Density as of the liver.
tumour       0.00106  42000  10  0.2  0.49
# Shear modulus of the order of 1 kPa: Small et al., Soft Matter 21, 2025, who name the
# measurements. It relaxes to a fraction of that.
brain        0.00104   3000  10  0.2  0.49
# Of phantoms: Dragon Skin 10, 264 kPa from the droop of a beam, with 1.07 g/cm3: Dubied et al., IEEE
# Robot Autom Lett 7, 2022.
silicone     0.00107 264000   5  0.05  0.49
)";

constexpr const char* form =
    ", expected name density young thickness damping_ratio [poisson [law] [prony:G@TAU,...]]";

/// Calls visit(number, line with its end, words) for each line that is not blank or a comment
/// alone.
template <class Visit>
void for_each_line(std::string_view text, Visit&& visit) {
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end);
    std::string_view rest = line.substr(0, line.find('#'));
    std::vector<std::string_view> words;
    constexpr const char* blanks = " \t\r\n\f\v";
    for (;;) {
      rest.remove_prefix(std::min(rest.find_first_not_of(blanks), rest.size()));
      if (rest.empty())
        break;
      words.push_back(rest.substr(0, rest.find_first_of(blanks)));
      rest.remove_prefix(words.back().size());
    }
    visit(number, line, words);
  }
}

std::string quoted(std::string_view word) {
  return "'" + std::string(word.substr(0, 40)) + (word.size() > 40 ? "…'" : "'");
}

bool bad_in_name(char c) {
  return c == '"' || c == ',' || c == '=' || static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
}

Material material_of(const std::vector<std::string_view>& words) {
  if (words.size() < 5 || words.size() > 8)
    throw Error(std::to_string(words.size()) + (words.size() == 1 ? " word" : " words") + form);
  Material m;
  m.name = words[0];
  if (std::any_of(m.name.begin(), m.name.end(), bad_in_name))
    throw Error(quoted(words[0]) +
                R"( is no name, expected one without ", comma, = and control characters)");
  struct Field {
    const char* name;
    double* value;
    bool zero;
  };
  const std::array<Field, 4> fields{{{"density", &m.density, false},
                                     {"Young's modulus", &m.young, false},
                                     {"thickness", &m.thickness, false},
                                     {"damping ratio", &m.damping_ratio, true}}};
  for (std::size_t k = 0; k < fields.size(); ++k) {
    const auto& [name, value, zero] = fields[k];
    const std::string_view word = words[k + 1];
    const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), *value);
    if (status != std::errc{} || rest != word.data() + word.size() || !std::isfinite(*value) ||
        !(zero ? *value >= 0 : *value > 0))
      throw Error(quoted(word) + " is no " + name + ", expected a finite number " +
                  (zero ? "of 0 or more" : "above 0"));
  }
  if (words.size() >= 6) {
    const std::string_view word = words[5];
    double value = 0;
    const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (status != std::errc{} || rest != word.data() + word.size() || !(value >= 0 && value < 0.5))
      throw Error(quoted(word) + " is no Poisson's ratio, expected 0 to below 0.5");
    m.poisson = value;
  }
  std::size_t next = 6;
  if (words.size() > next && !is_prony(words[next]))
    m.law = parse_law(words[next++]);
  if (words.size() > next)
    m.prony = parse_prony(words[next++]);
  if (words.size() > next)
    throw Error(quoted(words[next]) + " behind a Prony series, expected the end of the line");
  return m;
}

} // namespace

std::string_view preset_table() {
  return presets;
}

std::vector<Material> parse_material_table(std::string_view text, const std::string& name) {
  std::vector<Material> materials;
  for_each_line(
      text, [&](std::size_t number, std::string_view, const std::vector<std::string_view>& words) {
        if (words.empty())
          return;
        at(name + ":" + std::to_string(number), [&] {
          const Material m = material_of(words);
          for (const Material& other : materials)
            if (other.name == m.name)
              throw Error("a second material " + quoted(m.name) + ", expected another name");
          materials.push_back(m);
        });
      });
  if (materials.empty())
    throw Error(name, std::string("no material") + form);
  return materials;
}

std::string merged_tables(std::string_view table, std::string_view more) {
  std::vector<std::string_view> replaced;
  for_each_line(more, [&](std::size_t, std::string_view, const auto& words) {
    if (!words.empty())
      replaced.push_back(words[0]);
  });
  std::string text;
  for_each_line(table, [&](std::size_t, std::string_view line, const auto& words) {
    if (words.empty() || std::find(replaced.begin(), replaced.end(), words[0]) == replaced.end())
      text += line;
  });
  if (!text.empty() && text.back() != '\n')
    text += '\n';
  return text += more;
}

} // namespace gewebe::model
