#pragma once
// emboss-render --field: values of a result in the colours of a ramp.

#include "formats/stream/stream.h"
#include "tools/cli/cli.h"
#include "tools/render/render_arguments.h"

#include <cstdint>
#include <vector>

namespace gewebe::cli {

void declare_field(Program& program, RenderArguments& arguments);
/// \throw UsageError for what a field leaves no room for
void complete_field(RenderArguments& arguments);

/// Gives the surface the ramp as its base and the reading the field's range: that of --range, else
/// that of the drawn objects in the frames. \throw Error with place
void take_field(Run& run, RenderArguments& arguments, const formats::Input& input,
                const std::vector<std::int64_t>& frames);

} // namespace gewebe::cli
