#pragma once
// Where the camera stands and how large the picture is, as emboss-render is told.

#include "tools/render/render_arguments.h"

namespace gewebe::cli {

void declare_camera(Program& program, RenderArguments& arguments);
/// The words of it as what they mean. \throw UsageError
void complete_camera(RenderArguments& arguments);

} // namespace gewebe::cli
