#include "gl/gl_context.h"

#include "base/error.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <dlfcn.h>
#include <string_view>
#include <vector>

namespace gewebe::gl {
namespace {

/// libepoxy ends the process where these are missing, so look first. They stay loaded.
bool can_load(const char* name) {
  return ::dlopen(name, RTLD_LAZY | RTLD_LOCAL) != nullptr;
}

void require_libraries() {
  if (!can_load("libEGL.so.1"))
    throw Error("there is no EGL (libEGL.so.1), expected one");
  if (!can_load("libOpenGL.so.0") && !can_load("libGL.so.1"))
    throw Error("there is no OpenGL (libOpenGL.so.0 or libGL.so.1), expected one");
}

bool has_word(const char* list, std::string_view word) {
  std::string_view rest = list == nullptr ? "" : list;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    if (rest.substr(0, end) == word)
      return true;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return false;
}

struct Candidate {
  EGLDisplay display;
  const char* platform;
};

/// Displays in the order in which they are tried.
std::vector<Candidate> candidates() {
  std::vector<Candidate> found;
  const char* const extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (!has_word(extensions, "EGL_EXT_platform_base"))
    return found;
  if (has_word(extensions, "EGL_MESA_platform_surfaceless"))
    found.push_back(
        {eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr),
         "surfaceless"});
  if (has_word(extensions, "EGL_EXT_platform_device") &&
      (has_word(extensions, "EGL_EXT_device_enumeration") ||
       has_word(extensions, "EGL_EXT_device_base"))) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count) ==
        EGL_FALSE)
      count = 0;
    std::vector<Candidate> software;
    for (std::size_t d = 0; d < static_cast<std::size_t>(count); ++d) {
      const bool soft =
          has_word(eglQueryDeviceStringEXT(devices[d], EGL_EXTENSIONS), "EGL_MESA_device_software");
      (soft ? software : found)
          .push_back({eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[d], nullptr),
                      soft ? "software device" : "device"});
    }
    found.insert(found.end(), software.begin(), software.end());
  }
  return found;
}

EGLContext make_context(EGLDisplay display) {
  const char* const extensions = eglQueryString(display, EGL_EXTENSIONS);
  if (eglBindAPI(EGL_OPENGL_API) == EGL_FALSE ||
      !has_word(extensions, "EGL_KHR_surfaceless_context"))
    return EGL_NO_CONTEXT;
  EGLConfig config = EGL_NO_CONFIG_KHR;
  if (!has_word(extensions, "EGL_KHR_no_config_context")) {
    const std::array<EGLint, 5> wanted{EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                       EGL_NONE};
    EGLint count = 0;
    if (eglChooseConfig(display, wanted.data(), &config, 1, &count) == EGL_FALSE || count < 1)
      return EGL_NO_CONTEXT;
  }
  const std::array<EGLint, 5> version{EGL_CONTEXT_MAJOR_VERSION, 2, EGL_CONTEXT_MINOR_VERSION, 1,
                                      EGL_NONE};
  return eglCreateContext(display, config, EGL_NO_CONTEXT, version.data());
}

/// Whether the current context can do what gl_passes needs.
bool is_sufficient() {
  if (epoxy_gl_version() < 21 || !epoxy_is_desktop_gl())
    return false;
  if (epoxy_gl_version() < 30 && !(epoxy_has_gl_extension("GL_ARB_framebuffer_object") &&
                                   epoxy_has_gl_extension("GL_ARB_texture_float") &&
                                   epoxy_has_gl_extension("GL_ARB_color_buffer_float")))
    return false;
  GLint units = 0;
  glGetIntegerv(GL_MAX_TEXTURE_UNITS, &units); // 0 in a context without fixed functions
  return glGetError() == GL_NO_ERROR && units >= 2;
}

std::string text(GLenum name) {
  const GLubyte* const value = glGetString(name);
  return value == nullptr ? "" : reinterpret_cast<const char*>(value);
}

} // namespace

struct GlContext::State {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  std::string platform, renderer;
  int max_side = 0;

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() { close(); }

  void close() {
    if (display == EGL_NO_DISPLAY)
      return;
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context != EGL_NO_CONTEXT)
      eglDestroyContext(display, context);
    // The display is the process's and stays open: another context may live on it.
    display = EGL_NO_DISPLAY;
    context = EGL_NO_CONTEXT;
  }

  bool open(const Candidate& candidate) {
    if (candidate.display == EGL_NO_DISPLAY ||
        eglInitialize(candidate.display, nullptr, nullptr) == EGL_FALSE)
      return false;
    display = candidate.display;
    context = make_context(display);
    if (context != EGL_NO_CONTEXT &&
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_TRUE &&
        is_sufficient()) {
      platform = candidate.platform;
      renderer = text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
      GLint texture = 0, buffer = 0;
      std::array<GLint, 2> viewport{};
      glGetIntegerv(GL_MAX_TEXTURE_SIZE, &texture);
      glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &buffer);
      glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport.data());
      max_side = std::min({texture, buffer, viewport[0], viewport[1]});
      return true;
    }
    close();
    return false;
  }
};

GlContext::GlContext() : state_(std::make_unique<State>()) {
  require_libraries();
  const std::vector<Candidate> all = candidates();
  for (const Candidate& candidate : all)
    if (state_->open(candidate))
      return;
  throw Error(all.empty() ? "EGL offers no platform, expected surfaceless or a device"
                          : "EGL gives no context of OpenGL 2.1 with fixed functions and "
                            "framebuffer objects, expected a driver that does");
}
GlContext::~GlContext() = default;
GlContext::GlContext(GlContext&&) noexcept = default;
GlContext& GlContext::operator=(GlContext&&) noexcept = default;

void GlContext::make_current() {
  if (eglMakeCurrent(state_->display, EGL_NO_SURFACE, EGL_NO_SURFACE, state_->context) != EGL_TRUE)
    throw Error("EGL can't make its context current, expected it to");
}

const std::string& GlContext::platform() const {
  return state_->platform;
}
bool GlContext::is_software() const {
  constexpr std::array<std::string_view, 4> names{"llvmpipe", "softpipe", "swrast",
                                                  "Software Rasterizer"};
  return std::ranges::any_of(names, [&](std::string_view name) {
    return state_->renderer.find(name) != std::string::npos;
  });
}

const std::string& GlContext::renderer() const {
  return state_->renderer;
}
int GlContext::max_side() const {
  return state_->max_side;
}

} // namespace gewebe::gl
