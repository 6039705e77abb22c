#pragma once
// The report's two-pass algorithm on OpenGL's fixed functions (report 3.2.4, figure 3-7).

#include "base/context.h"
#include "render/camera.h"
#include "render/drawing.h"
#include "render/gl_context.h"
#include "render/image.h"
#include "render/look.h"

#include <cstdint>
#include <string>

namespace gewebe {

struct GlReport {
  int passes = 0;            ///< 2, or 1 without structure
  std::string target;        ///< of the colours: "RGBA32F" or "RGBA16F"
  std::uint64_t covered = 0; ///< pixels, or samples
};

/// Draws what render_cpu draws. First pass: two texture units make the relief r of the structure;
/// second pass: the base, where the first one's surface is seen, blended to 2 r base. The target
/// holds floats, so that nothing is rounded or clamped before the end.
/// \throw Error if the picture or a texture exceeds gl.max_side(), or OpenGL fails; Cancelled
Image render_gl(GlContext& gl, const Drawing& drawing, const Projection& projection,
                const Look& look, std::uint32_t width, std::uint32_t height, const Context& context,
                GlReport* report = nullptr);

/// Bytes that render_gl needs for a picture, in main memory where OpenGL is software.
double render_gl_bytes(std::uint32_t width, std::uint32_t height);

} // namespace gewebe
