#pragma once
// OpenGL without a window, through EGL.

#include <memory>
#include <string>

namespace gewebe::gl {

/// An OpenGL context, current on the thread that made it until it is destroyed there.
class GlContext {
public:
  /// A compatibility context of OpenGL 2.1 or later with framebuffer objects, float targets and two
  /// texture units, of the first that gives one: Mesa's surfaceless platform, a device, a device
  /// that is software. \throw Error if EGL, OpenGL or such a context is missing
  GlContext();
  ~GlContext();
  GlContext(GlContext&&) noexcept;
  GlContext& operator=(GlContext&&) noexcept;

  /// For a thread that has several. \throw Error if EGL fails
  void make_current();
  const std::string& platform() const; ///< "surfaceless", "device", "software device"
  const std::string& renderer() const; ///< what OpenGL calls itself
  bool is_software() const;            ///< no graphics card, by the name of renderer()
  int max_side() const;                ///< of pictures and textures

private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace gewebe::gl
