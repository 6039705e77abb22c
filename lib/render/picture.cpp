#include "render/picture.h"

#include "base/error.h"
#include "render/gl_context.h"
#include "render/gl_passes.h"
#include "render/raster_cpu.h"

#include <algorithm>
#include <charconv>

namespace gewebe {
namespace {

Image by_gl(const Drawing& drawing, const Projection& projection, const Look& look,
            std::uint32_t width, std::uint32_t height, const Context& context,
            PictureReport& report) {
  require_memory(context, render_gl_bytes(width, height), "the picture");
  GlContext gl;
  GlReport drawn;
  Image image = render_gl(gl, drawing, projection, look, width, height, context, &drawn);
  report.backend = Backend::gl;
  report.platform = gl.platform();
  report.renderer = gl.renderer();
  report.target = drawn.target;
  report.passes = drawn.passes;
  report.triangles = drawing.triangles.size();
  report.covered = drawn.covered;
  return image;
}

Image by_cpu(const Drawing& drawing, const Projection& projection, const Look& look,
             std::uint32_t width, std::uint32_t height, const Context& context,
             PictureReport& report) {
  require_memory(context, render_cpu_bytes(width, height, context), "the picture");
  RenderReport drawn;
  Image image = render_cpu(drawing, projection, look, width, height, context, &drawn);
  report.backend = Backend::cpu;
  report.passes = 1;
  report.triangles = drawn.triangles;
  report.covered = drawn.covered;
  return image;
}

} // namespace

const std::vector<std::string>& backend_names() {
  static const std::vector<std::string> names{"auto", "gl", "cpu"};
  return names;
}

Backend backend_from_name(std::string_view name) {
  const auto found = std::ranges::find(backend_names(), name);
  if (found == backend_names().end())
    throw Error("backend '" + std::string(name) + "' is unknown");
  return static_cast<Backend>(found - backend_names().begin());
}

std::pair<std::uint32_t, std::uint32_t> picture_size_from_text(std::string_view text) {
  const auto side = [&](std::string_view word) {
    std::uint32_t value = 0;
    const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (status != std::errc{} || rest != word.data() + word.size() || value < 1 || value > 32768)
      throw Error("'" + std::string(text) +
                  "' is no size, expected WxH or N with sides from 1 to "
                  "32768");
    return value;
  };
  const std::size_t mid = text.find_first_of("x,");
  if (mid == std::string_view::npos)
    return {side(text), side(text)};
  return {side(text.substr(0, mid)), side(text.substr(mid + 1))};
}

Image make_picture(const Drawing& drawing, const Camera& camera, const Look& look,
                   const PictureOptions& options, const Context& context, PictureReport* report) {
  const std::uint64_t width = std::uint64_t{options.width} * options.supersample;
  const std::uint64_t height = std::uint64_t{options.height} * options.supersample;
  if (std::max(width, height) > max_picture_side)
    throw Error("a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                " samples, expected sides up to " + std::to_string(max_picture_side));
  const auto w = static_cast<std::uint32_t>(width), h = static_cast<std::uint32_t>(height);
  const Projection projection = make_projection(camera, drawing.box, drawing.origin, drawing.scale);
  PictureReport ours;
  PictureReport& told = report != nullptr ? *report : ours;
  if (options.backend != Backend::cpu) {
    try {
      return shrunk(by_gl(drawing, projection, look, w, h, context, told), options.supersample);
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      if (options.backend == Backend::gl)
        throw;
      told.gl_failure = error.what();
    }
  }
  return shrunk(by_cpu(drawing, projection, look, w, h, context, told), options.supersample);
}

} // namespace gewebe
