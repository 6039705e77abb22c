#pragma once
// How light falls on what emboss-render draws: films of water, what near surfaces hide, an
// endoscope.

#include "shading/drawing.h"
#include "texture/surface_material.h"
#include "tools/cli/cli.h"
#include "tools/render/render_arguments.h"

namespace gewebe::cli {

void declare_lighting(Program& program, RenderArguments& arguments);
/// \throw UsageError
void complete_lighting(RenderArguments& arguments);

/// Adds the group of what is seen from within behind those of tissue, if it has a colour.
void add_inside_material(texture::SurfaceMaterial& common, const RenderArguments& arguments);

/// The film of a material that was given one of its own, or that of all.
texture::WetFilm film_of(const RenderArguments& arguments, const RenderMaterial* own);

} // namespace gewebe::cli
