#pragma once
// Draws a picture by the requested or available backend.

#include "base/context.h"
#include "gl/gl_renderer.h"
#include "shading/camera.h"
#include "shading/drawing.h"
#include "texture/image.h"
#include "texture/surface_material.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gewebe::render {

enum class Backend {
  automatic, ///< OpenGL on a graphics card, else our rasteriser, which is quicker than software
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
  int samples = 1;               ///< of each of them, 1 or 4 (multisampling)
  gl::GlOptions gl;              ///< of the backend gl; its samples don't count
  std::optional<bool> per_pixel; ///< frames for each pixel; nothing: where the mode can
};

struct PictureReport {
  Backend backend = Backend::cpu;         ///< that drew
  std::string gl_failure;                 ///< why OpenGL did not, where it failed
  std::string platform, renderer, target; ///< OpenGL's, see gl_context.h and gl_renderer.h
  int passes = 1;
  std::uint64_t uploads = 0;   ///< drawings that OpenGL was given, until now
  std::uint64_t triangles = 0; ///< cpu: in the view and not without area; gl: all
  std::uint64_t covered = 0;   ///< samples; cpu alone
};

/// Draws pictures of one material and size. What a sequence keeps is kept: the context of OpenGL,
/// the shader, the textures there.
class Painter {
public:
  /// With Backend::automatic OpenGL is tried, and what fails kept for the report; one that is
  /// software counts where the mode is one of its fixed functions alone.
  /// \throw Error if sides times supersample exceed max_picture_side or the estimate the memory,
  /// and, with Backend::gl, where OpenGL fails
  Painter(const texture::SurfaceMaterial& material, const PictureOptions& options,
          const Context& context);
  ~Painter();
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;

  /// Whether drawings should have frames: by default for the rasteriser and the shader.
  bool per_pixel() const;
  /// \pre the drawing has no more groups than the material; drawings with versions are one maker's
  /// The picture, three channels. All modes draw the same: of 255, values differ by 2 at most where
  /// the picture is continuous, for one kind of drawings.
  /// \throw Error where OpenGL fails; Cancelled
  texture::Image paint(const shading::Drawing& drawing, const shading::Camera& camera,
                       PictureReport* report = nullptr);

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// One picture.
texture::Image make_picture(const shading::Drawing& drawing, const shading::Camera& camera,
                            const texture::SurfaceMaterial& material, const PictureOptions& options,
                            const Context& context, PictureReport* report = nullptr);

} // namespace gewebe::render
