#pragma once
// Surfaces, fields and forces of an input over time, for pages and glTF files.

#include "formats/page/shown_scene.h"
#include "formats/stream/stream.h"
#include "tools/cli/cli.h"
#include "tools/render/render_arguments.h"

#include <cstdint>
#include <vector>

namespace gewebe::cli {

/// Everything of the scene but its view. Of a result all fields that it has, instruments, and
/// curves: the greatest displacement and stress of each object, forces and torques on instruments.
/// \param frames of a result; ignored for others, which have one frame at time 0
/// \throw Error with place, also if the scene needs more memory than the run may use
formats::ShownScene build_scene(Run& run, const RenderArguments& arguments, formats::Input& input,
                                const std::vector<std::int64_t>& frames);

} // namespace gewebe::cli
