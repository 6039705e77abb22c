#pragma once
// emboss-render for volumes.

#include "formats/stream/kind.h"
#include "formats/stream/stream.h"
#include "texture/color_ramp.h"
#include "texture/image.h"
#include "tools/cli/cli.h"
#include "tools/render/render_arguments.h"

namespace gewebe::cli {

/// Declares the options that only volumes have.
void declare_volume(Program& program, RenderArguments& arguments);
/// Checks those options and turns their words into numbers. \throw UsageError
void complete_volume(RenderArguments& arguments);
/// \throw UsageError for options that an input of that kind has no use for
void check_kind(const RenderArguments& arguments, const formats::Input& input, formats::Kind kind);

/// The ramp of a name, or of an image. \throw Error with place
texture::ColorRamp ramp_of(const std::string& word, const Context& context);

/// The picture of the volume. \throw Error with place
texture::Image volume_picture(Run& run, const RenderArguments& arguments, formats::Input& input);

} // namespace gewebe::cli
