#pragma once
// The picture without OpenGL: our own rasteriser, the same bytes on every machine and for any
// number of threads.

#include "base/context.h"
#include "render/camera.h"
#include "render/drawing.h"
#include "render/image.h"
#include "render/look.h"

#include <cstdint>

namespace gewebe {

/// The largest side of a picture, samples included.
constexpr std::uint32_t max_picture_side = 65536;

struct RenderReport {
  std::uint64_t triangles = 0; ///< drawn: in the view and not without area (GL: all)
  std::uint64_t covered = 0;   ///< pixels, or samples
};

/// Draws `drawing` as width × height pixels of `look`. A pixel has the value at its centre; a
/// triangle owns the centres inside it and those on its top and left edges; the nearest surface is
/// seen, from both sides; attributes are linear in space. Of coincident surfaces the first counts.
/// \pre width, height <= max_picture_side   \throw Cancelled
Image render_cpu(const Drawing& drawing, const Projection& projection, const Look& look,
                 std::uint32_t width, std::uint32_t height, const Context& context,
                 RenderReport* report = nullptr);

/// Bytes that render_cpu needs for a picture, without its drawing.
double render_cpu_bytes(std::uint32_t width, std::uint32_t height, const Context& context);

} // namespace gewebe
