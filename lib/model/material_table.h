#pragma once
// Materials as a table of text (gewebe_materials(5)): one per line, `name density young thickness
// damping_ratio [poisson [law] [prony]]`, # comments.

#include "model/model.h"

#include <string>
#include <string_view>
#include <vector>

namespace gewebe::model {

/// The table of the presets, with where their numbers come from.
std::string_view preset_table();

/// The materials in the order of their lines. Density, Young's modulus and thickness are positive,
/// the damping ratio is 0 or more, Poisson's ratio, if given, 0 to below 1/2, all are finite; a
/// law is one of parse_law(). A name holds no blank, `"`, `,`, `=` or control character and comes
/// once. \throw Error, place "NAME:LINE", for a line that is not like this; place NAME if there is
/// no material
std::vector<Material> parse_material_table(std::string_view text, const std::string& name);

/// Both tables as one, which parses: that of `more` verbatim, behind `table` without the lines of
/// the materials that `more` has too. \pre both parse
std::string merged_tables(std::string_view table, std::string_view more);

} // namespace gewebe::model
