#pragma once
// The report's three algorithms on OpenGL's fixed functions (report 3.2.4, figures 3-6 to 3-8), and
// one on shaders.

#include "base/context.h"
#include "gl/gl_context.h"
#include "shading/camera.h"
#include "shading/drawing.h"
#include "texture/image.h"
#include "texture/surface_material.h"

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::gl {

enum class GlMode {
  passes3, ///< one texture unit: f, then 1 - f' added, then the colours blended to 2 r c
  passes2, ///< two units make r, then colours by as many units as there are, blended to 2 r c
  passes1, ///< all in one: base and structure as one texture of four channels
  shader   ///< GLSL
};

/// "3", "2", "1", "shader".
const std::vector<std::string>& gl_mode_names();
/// \throw Error if there is no such mode
GlMode gl_mode_from_name(std::string_view name);

struct GlOptions {
  GlMode mode = GlMode::shader;
  bool wide = true;  ///< a target of floats, so that nothing is rounded or clamped between passes
  int samples = 1;   ///< or 4
  int rgb_scale = 2; ///< of passes1: s of the composition, 1 as the report had it, or 2
};

/// Draws what render_cpu draws. Textures are loaded once, a drawing when it is set. With further
/// colour textures passes3 makes more passes: it composes the colours, keeps r in the target's
/// alpha and multiplies at the end. passes1 enlarges the smaller one of base and structure. \throw
/// Error if the picture or a texture exceeds gl.max_side(), the OpenGL lacks what the mode needs,
/// or fails; for passes1 also if base and structure aren't mapped alike
class GlRenderer {
public:
  GlRenderer(GlContext& gl, const texture::SurfaceMaterial& material, std::uint32_t width,
             std::uint32_t height, const GlOptions& options);
  ~GlRenderer();
  GlRenderer(const GlRenderer&) = delete;
  GlRenderer& operator=(const GlRenderer&) = delete;

  /// \pre a mode of the fixed functions has no use for frames: there are none
  void set_drawing(const shading::Drawing& drawing);
  /// Of a drawing whose vertices, frames and triangles are those that were set.
  void set_light(const shading::Drawing& drawing);
  /// \throw Cancelled
  void draw(const shading::Projection& projection, const Context& context);
  void finish(); ///< waits until all is drawn
  texture::Image read(const Context& context);

  const std::string& target() const; ///< "RGBA32F", "RGBA16F", "RGBA8"
  int passes() const;                ///< of the last draw

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Bytes that a picture needs, in main memory where OpenGL is software.
double render_gl_bytes(std::uint32_t width, std::uint32_t height, int samples);

} // namespace gewebe::gl
