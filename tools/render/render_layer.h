#pragma once
// One texture of those that emboss-render was given: a file or a solid one.

#include "tools/render/render_arguments.h"

#include <array>
#include <string>

namespace gewebe::cli {

/// Base, detail, reflection, structure.
using RenderLayers = std::array<const RenderLayer*, 4>;

/// Distinguishes "noise" and "veins" from files, and sets what the texture needs. `word` is
/// "texture", "detail", "reflection" or "structure". \throw UsageError
void complete_layer(RenderArguments& arguments, const std::string& word, RenderLayer& layer);

/// Gives `material` those that are there in place of its own. \throw Error with place
void take_textures(texture::SurfaceMaterial& material, const RenderLayers& layers,
                   const Context& context);

} // namespace gewebe::cli
