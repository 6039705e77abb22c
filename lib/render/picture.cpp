#include "render/picture.h"

#include "base/error.h"
#include "gl/gl_context.h"
#include "raster/raster_cpu.h"

#include <algorithm>
#include <charconv>

namespace gewebe::render {
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

struct Painter::State {
  State(const texture::SurfaceMaterial& l, const PictureOptions& o, const Context& c)
      : material(l), options(o), context(c) {
    const std::uint64_t w = std::uint64_t{options.width} * options.supersample;
    const std::uint64_t h = std::uint64_t{options.height} * options.supersample;
    if (std::max(w, h) > raster::max_picture_side)
      throw Error("a picture of " + std::to_string(w) + " x " + std::to_string(h) +
                  " samples, expected sides up to " + std::to_string(raster::max_picture_side));
    width = static_cast<std::uint32_t>(w);
    height = static_cast<std::uint32_t>(h);
    if (options.backend != Backend::cpu)
      attempt([&] {
        require_memory(context, gl::render_gl_bytes(width, height, options.samples), "the picture");
        gl.emplace();
        if (options.backend == Backend::automatic && options.gl.mode == gl::GlMode::shader &&
            gl->is_software())
          return gl.reset();
        gl::GlOptions with_samples = options.gl;
        with_samples.samples = options.samples;
        renderer.emplace(*gl, material, width, height, with_samples);
      });
    if (!renderer)
      require_memory(context, raster::render_cpu_bytes(width, height, options.samples, context),
                     "the picture");
  }

  ~State() {
    try { // objects are deleted in the context that has them
      if (gl)
        gl->make_current();
    } catch (const Error&) { // they go with the context
    }
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  /// What fails is an error for Backend::gl, and ends OpenGL for automatic.
  template <class Work>
  void attempt(Work&& work) {
    try {
      work();
    } catch (const Cancelled&) {
      throw;
    } catch (const Error& error) {
      if (options.backend == Backend::gl)
        throw;
      gl_failure = error.what();
      renderer.reset();
      gl.reset();
    }
  }

  texture::SurfaceMaterial material;
  PictureOptions options;
  Context context;
  std::uint32_t width = 0, height = 0;
  std::optional<gl::GlContext> gl;
  std::optional<gl::GlRenderer> renderer;
  std::string gl_failure;
  std::uint64_t version = 0, uploads = 0; ///< of the drawing that OpenGL has
};

Painter::Painter(const texture::SurfaceMaterial& material, const PictureOptions& options,
                 const Context& context)
    : state_(std::make_unique<State>(material, options, context)) {}
Painter::~Painter() = default;

bool Painter::per_pixel() const {
  const PictureOptions& options = state_->options;
  const bool can = options.backend == Backend::cpu || options.gl.mode == gl::GlMode::shader;
  return options.per_pixel.value_or(can);
}

texture::Image Painter::paint(const shading::Drawing& drawing, const shading::Camera& camera,
                              PictureReport* report) {
  State& s = *state_;
  const shading::Projection projection =
      shading::make_projection(camera, drawing.box, drawing.origin, drawing.scale);
  PictureReport ours;
  PictureReport& told = report != nullptr ? *report : ours;
  texture::Image image;
  if (s.renderer)
    s.attempt([&] {
      s.gl->make_current();
      if (drawing.version != 0 && drawing.version == s.version) {
        s.renderer->set_light(drawing);
      } else {
        s.renderer->set_drawing(drawing);
        s.version = drawing.version;
        ++s.uploads;
      }
      told.uploads = s.uploads;
      s.renderer->draw(projection, s.context);
      image = s.renderer->read(s.context);
      told.backend = Backend::gl;
      told.platform = s.gl->platform();
      told.renderer = s.gl->renderer();
      told.target = s.renderer->target();
      told.passes = s.renderer->passes();
      told.triangles = drawing.triangles.size();
    });
  told.gl_failure = s.gl_failure;
  if (!s.renderer) {
    raster::RenderReport drawn;
    image = raster::render_cpu(drawing, projection, s.material, s.width, s.height,
                               s.options.samples, s.context, &drawn);
    told.backend = Backend::cpu;
    told.passes = 1;
    told.triangles = drawn.triangles;
    told.covered = drawn.covered;
  }
  return texture::shrunk(image, s.options.supersample);
}

texture::Image make_picture(const shading::Drawing& drawing, const shading::Camera& camera,
                            const texture::SurfaceMaterial& material, const PictureOptions& options,
                            const Context& context, PictureReport* report) {
  return Painter(material, options, context).paint(drawing, camera, report);
}

} // namespace gewebe::render
