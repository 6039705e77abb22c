#pragma once
// emboss-render -o FILE.html or FILE.glb: the scene itself instead of a picture.

#include "formats/stream/stream.h"
#include "tools/cli/cli.h"
#include "tools/render/render_arguments.h"

namespace gewebe::cli {

/// Remembers which options of looks and views were given, for write_scene. \pre called by a check
void note_look_options(const Program& program, RenderArguments& arguments);

/// html and glb.
const std::vector<formats::Kind>& scene_kinds();

/// Reads the input, builds the scene and writes it. \throw UsageError for options that the kind
/// cannot serve; Error with place
void write_scene(Run& run, const RenderArguments& arguments, formats::Input& input,
                 formats::Kind to);

} // namespace gewebe::cli
