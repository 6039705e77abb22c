#pragma once
// Camera and size of the picture, from the command line of emboss-render.

#include "tools/render/render_arguments.h"

namespace gewebe::cli {

void declare_camera(Program& program, RenderArguments& arguments);
/// The words of it as what they mean. \throw UsageError
void complete_camera(RenderArguments& arguments);

} // namespace gewebe::cli
