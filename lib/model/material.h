#pragma once
// Materials by name, with values from the literature.

#include "model/model.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gewebe::model {

/// The presets: generic, liver, gallbladder, uterus.
const std::vector<Material>& material_presets();

/// The one of that name. \throw Error naming those there are
Material material_named(std::string_view name, const std::vector<Material>& table);

/// The materials of a mesh in parts.
struct MaterialChoice {
  std::vector<Material> materials;
  std::vector<std::int32_t> of_part;    ///< material of part p; of all further parts: 0
  std::vector<std::int32_t> named = {}; ///< the parts that were named, ascending
  /// Names of parts whose numbers are not known yet, and their materials; see number_parts.
  std::vector<std::pair<std::string, std::int32_t>> by_name = {};

  bool operator==(const MaterialChoice&) const = default;
};

/// Which of its materials a part has.
std::int32_t chosen_material(const MaterialChoice& choice, std::int32_t part);

/// Gives their numbers to the parts that were chosen by name; `names` are those of parts 0, 1, ...
/// Several parts may share a name. \throw Error if a name is none of them, saying which there are,
/// or if a part has two materials
void number_parts(MaterialChoice& choice, std::span<const std::string> names);

/// \throw Error if a part was named that none of `parts` is, saying which there are
void require_parts(const MaterialChoice& choice, std::span<const std::int32_t> parts);

/// What replaces the values of materials.
struct MaterialOverrides {
  std::optional<double> density, young, thickness, damping_ratio, poisson;
  std::optional<HyperelasticLaw> law = {};
  std::optional<std::vector<PronyTerm>> prony = {};
};
void override_materials(std::vector<Material>& materials, const MaterialOverrides& values);

/// Understands "NAME" and, after it or alone, "PART=NAME", separated by commas:
/// "liver,2=gallbladder". PART is the number of a part, or its name. Parts that are not named get
/// NAME, or the table's first, generic among the presets. \pre the table is not empty   \throw
/// Error
MaterialChoice parse_material_choice(std::string_view text,
                                     const std::vector<Material>& table = material_presets());

} // namespace gewebe::model
