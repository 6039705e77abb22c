#pragma once
// A picture by whichever backend is wanted or there.

#include "base/context.h"
#include "render/camera.h"
#include "render/drawing.h"
#include "render/image.h"
#include "render/look.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gewebe {

enum class Backend {
  automatic, ///< OpenGL, or our rasteriser where that fails
  gl,
  cpu
};

/// "auto", "gl", "cpu".
const std::vector<std::string>& backend_names();
/// \throw Error if there is no such backend
Backend backend_from_name(std::string_view name);

/// "640x480", "640,480" or "512" for a square. \throw Error if it is none of them, or a side is 0
/// or above 32768
std::pair<std::uint32_t, std::uint32_t> picture_size_from_text(std::string_view text);

struct PictureOptions {
  Backend backend = Backend::automatic;
  std::uint32_t width = 512, height = 512;
  std::uint32_t supersample = 1; ///< a pixel is the mean of this many samples squared
};

struct PictureReport {
  Backend backend = Backend::cpu;         ///< that drew
  std::string gl_failure;                 ///< why OpenGL did not, where it was tried
  std::string platform, renderer, target; ///< OpenGL's, see gl_context.h and gl_passes.h
  int passes = 1;
  std::uint64_t triangles = 0; ///< cpu: in the view and not without area; gl: all
  std::uint64_t covered = 0;   ///< samples
};

/// The picture, three channels. Both backends draw the same: values differ by 2 of 255 at most
/// where the picture is continuous.
/// \throw Error if sides times supersample exceed max_picture_side or the estimate the memory, and,
/// with Backend::gl, where OpenGL fails; Cancelled
Image make_picture(const Drawing& drawing, const Camera& camera, const Look& look,
                   const PictureOptions& options, const Context& context,
                   PictureReport* report = nullptr);

} // namespace gewebe
