#pragma once
// Textures by material, part or object.

#include "tools/render_arguments.h"

#include <string>
#include <vector>

namespace gewebe::cli {

/// Gives the textures of materials the options of those of all, and the drawing what they need.
/// \throw UsageError
void complete_materials(RenderArguments& arguments);

/// Whether the structure of some material, or of all, is solid.
bool has_solid_structure(const RenderArguments& arguments);

/// Their files.
std::vector<std::string> material_paths(const RenderArguments& arguments);

/// Reads their textures: the looks of the groups 1, 2, … in `look`, which holds what is for all.
/// \throw Error with place
void add_material_looks(Look& look, const RenderArguments& arguments, const Context& context);

} // namespace gewebe::cli
