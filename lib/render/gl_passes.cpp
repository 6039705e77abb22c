#include "render/gl_passes.h"

#include "base/error.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

// Based on: report FZKA 7190, 2006, section 3.2.4, render-pass-2.

namespace gewebe {
namespace {

/// Deletes OpenGL's objects of one kind.
class Names {
public:
  using Delete = void (*)(GLsizei, const GLuint*);
  explicit Names(Delete del) : delete_(del) {}
  ~Names() {
    if (!names_.empty())
      delete_(static_cast<GLsizei>(names_.size()), names_.data());
  }
  Names(const Names&) = delete;
  Names& operator=(const Names&) = delete;

  GLuint keep(GLuint name) {
    names_.push_back(name);
    return name;
  }

private:
  Delete delete_;
  std::vector<GLuint> names_;
};

// epoxy's names are pointers that change at the first call, so functions of our own stand for them.
void delete_textures(GLsizei n, const GLuint* names) {
  glDeleteTextures(n, names);
}
void delete_buffers(GLsizei n, const GLuint* names) {
  glDeleteBuffers(n, names);
}
void delete_renderbuffers(GLsizei n, const GLuint* names) {
  glDeleteRenderbuffers(n, names);
}
void delete_framebuffers(GLsizei n, const GLuint* names) {
  glDeleteFramebuffers(n, names);
}

/// A framebuffer of float colours, depth and stencil.
class Target {
public:
  Target(std::uint32_t width, std::uint32_t height) {
    const auto w = static_cast<GLsizei>(width), h = static_cast<GLsizei>(height);
    std::array<GLuint, 2> buffers{};
    GLuint framebuffer = 0;
    glGenFramebuffers(1, &framebuffer);
    framebuffers_.keep(framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glGenRenderbuffers(2, buffers.data());
    for (const GLuint buffer : buffers)
      renderbuffers_.keep(buffer);
    glBindRenderbuffer(GL_RENDERBUFFER, buffers[1]);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH24_STENCIL8, w, h);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_STENCIL_ATTACHMENT, GL_RENDERBUFFER,
                              buffers[1]);
    for (const auto& [format, name] :
         {std::pair<GLenum, const char*>{GL_RGBA32F, "RGBA32F"}, {GL_RGBA16F, "RGBA16F"}}) {
      glBindRenderbuffer(GL_RENDERBUFFER, buffers[0]);
      glRenderbufferStorage(GL_RENDERBUFFER, format, w, h);
      glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, buffers[0]);
      if (glGetError() == GL_NO_ERROR &&
          glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) {
        format_ = name;
        return;
      }
    }
    throw Error("OpenGL gives no float target of " + std::to_string(width) + " x " +
                std::to_string(height) + " pixels, expected one");
  }

  const char* format() const { return format_; }

private:
  Names framebuffers_{delete_framebuffers}, renderbuffers_{delete_renderbuffers};
  const char* format_ = "";
};

GLuint make_texture(Names& names, const Texture& texture) {
  GLuint name = 0;
  glGenTextures(1, &name);
  names.keep(name);
  glBindTexture(GL_TEXTURE_2D, name);
  for (const auto& [parameter, value] : {std::pair<GLenum, GLint>{GL_TEXTURE_MIN_FILTER, GL_LINEAR},
                                         {GL_TEXTURE_MAG_FILTER, GL_LINEAR},
                                         {GL_TEXTURE_WRAP_S, GL_REPEAT},
                                         {GL_TEXTURE_WRAP_T, GL_REPEAT}})
    glTexParameteri(GL_TEXTURE_2D, parameter, value);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  const bool gray = texture.channels == 1;
  glTexImage2D(GL_TEXTURE_2D, 0, gray ? GL_LUMINANCE8 : GL_RGB8,
               static_cast<GLsizei>(texture.width), static_cast<GLsizei>(texture.height), 0,
               gray ? GL_LUMINANCE : GL_RGB, GL_UNSIGNED_BYTE, texture.values.data());
  return name;
}

void stop_if_cancelled(const Context& context) {
  if (context.cancelled && context.cancelled())
    throw Cancelled();
}

/// The geometry in buffers of OpenGL, drawn once a pass.
class Geometry {
public:
  explicit Geometry(const Drawing& drawing) : indices_(3 * drawing.triangles.size()) {
    glGenBuffers(2, buffers_.data());
    for (const GLuint buffer : buffers_)
      names_.keep(buffer);
    glBindBuffer(GL_ARRAY_BUFFER, buffers_[0]);
    glBufferData(GL_ARRAY_BUFFER,
                 static_cast<GLsizeiptr>(drawing.vertices.size() * sizeof(DrawVertex)),
                 drawing.vertices.data(), GL_STATIC_DRAW);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers_[1]);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER,
                 static_cast<GLsizeiptr>(drawing.triangles.size() * sizeof(Triangle)),
                 drawing.triangles.data(), GL_STATIC_DRAW);
    glEnableClientState(GL_VERTEX_ARRAY);
    glVertexPointer(3, GL_FLOAT, sizeof(DrawVertex), at(offsetof(DrawVertex, position)));
  }

  /// OpenGL takes offsets into buffers as pointers.
  static const void* at(std::size_t offset) {
    return reinterpret_cast<const void*>(offset); // NOLINT(performance-no-int-to-ptr)
  }

  /// Coordinates of one texture unit: of the base, or shifted towards the light.
  void use_texcoords(GLenum unit, bool shifted) const {
    glBindBuffer(GL_ARRAY_BUFFER, buffers_[0]); // what the pointer counts from
    glClientActiveTexture(unit);
    glEnableClientState(GL_TEXTURE_COORD_ARRAY);
    glTexCoordPointer(2, GL_FLOAT, sizeof(DrawVertex),
                      at(shifted ? offsetof(DrawVertex, shifted) : offsetof(DrawVertex, st)));
  }

  void draw(const Context& context) const {
    constexpr std::size_t piece = 3U << 20; // indices
    for (std::size_t from = 0; from < indices_; from += piece) {
      stop_if_cancelled(context);
      glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(std::min(piece, indices_ - from)),
                     GL_UNSIGNED_INT, at(from * sizeof(std::uint32_t)));
    }
  }

private:
  Names names_{delete_buffers};
  std::array<GLuint, 2> buffers_{};
  std::size_t indices_;
};

void set_matrices(const Projection& projection) {
  std::array<double, 16> columns{};
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      columns[4 * column + row] = projection.matrix[row][column];
  glMatrixMode(GL_PROJECTION);
  glLoadMatrixd(columns.data());
  glMatrixMode(GL_MODELVIEW);
  glLoadIdentity();
}

void use_texture(GLenum unit, GLuint texture) {
  glActiveTexture(unit);
  glEnable(GL_TEXTURE_2D);
  glBindTexture(GL_TEXTURE_2D, texture);
}

void drop_texture(GLenum unit) {
  glActiveTexture(unit);
  glDisable(GL_TEXTURE_2D);
  glClientActiveTexture(unit);
  glDisableClientState(GL_TEXTURE_COORD_ARRAY);
}

void set_env(GLenum name, GLenum value) {
  glTexEnvi(GL_TEXTURE_ENV, name, static_cast<GLint>(value));
}

/// Pass 1: r = 1/2 f + (1 - 1/2) (1 - f'), f' the structure shifted towards the light. (Added as
/// f + (1 - f') - 1/2 the relief would be twice as strong.)
void draw_relief(const Geometry& geometry, GLuint structure, const Context& context) {
  use_texture(GL_TEXTURE0, structure);
  geometry.use_texcoords(GL_TEXTURE0, false);
  set_env(GL_TEXTURE_ENV_MODE, GL_REPLACE);

  use_texture(GL_TEXTURE1, structure);
  geometry.use_texcoords(GL_TEXTURE1, true);
  const std::array<float, 4> half{0.5F, 0.5F, 0.5F, 1.0F};
  glTexEnvfv(GL_TEXTURE_ENV, GL_TEXTURE_ENV_COLOR, half.data());
  set_env(GL_TEXTURE_ENV_MODE, GL_COMBINE);
  set_env(GL_COMBINE_RGB, GL_INTERPOLATE);
  set_env(GL_SRC0_RGB, GL_PREVIOUS);
  set_env(GL_OPERAND0_RGB, GL_SRC_COLOR);
  set_env(GL_SRC1_RGB, GL_TEXTURE);
  set_env(GL_OPERAND1_RGB, GL_ONE_MINUS_SRC_COLOR);
  set_env(GL_SRC2_RGB, GL_CONSTANT);
  set_env(GL_OPERAND2_RGB, GL_SRC_COLOR);
  set_env(GL_COMBINE_ALPHA, GL_REPLACE);
  set_env(GL_SRC0_ALPHA, GL_PRIMARY_COLOR);
  set_env(GL_OPERAND0_ALPHA, GL_SRC_ALPHA);
  glColor4f(1, 1, 1, 1);
  geometry.draw(context);
  drop_texture(GL_TEXTURE1);
  drop_texture(GL_TEXTURE0);
}

/// Colours of the vertices: the look's times the vertex's shade.
std::vector<std::array<float, 4>> vertex_colors(const Drawing& drawing, const Look& look) {
  std::vector<std::array<float, 4>> colors;
  colors.reserve(drawing.vertices.size());
  for (const DrawVertex& v : drawing.vertices)
    colors.push_back({static_cast<float>(look.color.x * double{v.shade}),
                      static_cast<float>(look.color.y * double{v.shade}),
                      static_cast<float>(look.color.z * double{v.shade}), 1.0F});
  return colors;
}

/// Pass 2, or the only one: the base times the colour.
void draw_base(const Geometry& geometry, const Drawing& drawing, const Look& look, GLuint base,
               Names& buffers, const Context& context) {
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  buffers.keep(buffer);
  {
    const std::vector<std::array<float, 4>> colors = vertex_colors(drawing, look);
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(colors.size() * sizeof colors[0]),
                 colors.data(), GL_STATIC_DRAW);
  }
  glEnableClientState(GL_COLOR_ARRAY);
  glColorPointer(4, GL_FLOAT, 0, nullptr);
  if (look.base) {
    use_texture(GL_TEXTURE0, base);
    geometry.use_texcoords(GL_TEXTURE0, false);
    set_env(GL_TEXTURE_ENV_MODE, GL_MODULATE);
  }
  geometry.draw(context);
  glDisableClientState(GL_COLOR_ARRAY);
  if (look.base)
    drop_texture(GL_TEXTURE0);
}

void check_gl() {
  const GLenum error = glGetError();
  if (error == GL_OUT_OF_MEMORY)
    throw Error("OpenGL is out of memory, expected a smaller picture, mesh or texture");
  if (error != GL_NO_ERROR)
    throw Error("OpenGL failed with error " + std::to_string(error) + ", expected none");
}

/// The target's colours as 8 bits, rows from the top; the background where nothing was drawn.
Image read_back(std::uint32_t width, std::uint32_t height, const Look& look, const Context& context,
                std::uint64_t& covered) {
  Image image{width, height, 3, {}};
  image.values.resize(std::size_t{3} * width * height);
  const std::array<std::uint8_t, 3> background = stored(look.background);
  constexpr std::uint32_t rows_at_once = 16;
  std::vector<std::array<float, 4>> rows(std::size_t{rows_at_once} * width);
  covered = 0;
  for (std::uint32_t from = 0; from < height; from += rows_at_once) {
    stop_if_cancelled(context);
    const std::uint32_t count = std::min(rows_at_once, height - from);
    glReadPixels(0, static_cast<GLint>(from), static_cast<GLsizei>(width),
                 static_cast<GLsizei>(count), GL_RGBA, GL_FLOAT, rows.data());
    for (std::uint32_t row = 0; row < count; ++row) {
      std::uint8_t* out = &image.values[std::size_t{3} * width * (height - 1 - from - row)];
      for (std::size_t x = 0; x < width; ++x, out += 3) {
        const std::array<float, 4>& value = rows[std::size_t{row} * width + x];
        const bool drawn = value[3] > 0;
        covered += drawn ? 1U : 0U;
        for (std::size_t c = 0; c < 3; ++c)
          out[c] = drawn ? stored(double{value[c]}) : background[c];
      }
    }
  }
  return image;
}

void check_sides(const GlContext& gl, const Look& look, std::uint32_t width, std::uint32_t height) {
  const auto check = [&](const char* what, std::uint32_t w, std::uint32_t h) {
    if (std::max(w, h) > static_cast<std::uint32_t>(gl.max_side()))
      throw Error(std::string(what) + " of " + std::to_string(w) + " x " + std::to_string(h) +
                  " exceeds this OpenGL, expected sides up to " + std::to_string(gl.max_side()));
  };
  check("a picture", width, height);
  if (look.base)
    check("a texture", look.base->width, look.base->height);
  if (look.structure)
    check("a texture", look.structure->width, look.structure->height);
}

} // namespace

Image render_gl(GlContext& gl, const Drawing& drawing, const Projection& projection,
                const Look& look, std::uint32_t width, std::uint32_t height, const Context& context,
                GlReport* report) {
  check_sides(gl, look, width, height);
  const Target target(width, height);
  glViewport(0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  glClampColor(GL_CLAMP_READ_COLOR, GL_FALSE);
  glClampColor(GL_CLAMP_FRAGMENT_COLOR, GL_FALSE);
  glClearColor(0, 0, 0, 0); // alpha tells where something was drawn
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  glDisable(GL_CULL_FACE);
  glDisable(GL_DITHER);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);

  Names textures(delete_textures), buffers(delete_buffers);
  if (!drawing.triangles.empty()) {
    set_matrices(projection);
    const Geometry geometry(drawing);
    const GLuint base = look.base ? make_texture(textures, *look.base) : 0;
    if (look.structure) {
      draw_relief(geometry, make_texture(textures, *look.structure), context);
      // 2 c r: c times what stands there, plus what stands there times c. Once a pixel: the stencil
      // keeps coincident faces from being blended twice.
      glDepthFunc(GL_EQUAL);
      glEnable(GL_BLEND);
      glBlendFunc(GL_DST_COLOR, GL_SRC_COLOR);
      glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_FALSE);
      glEnable(GL_STENCIL_TEST);
      glStencilFunc(GL_EQUAL, 0, 0xff);
      glStencilOp(GL_KEEP, GL_KEEP, GL_INCR);
    }
    draw_base(geometry, drawing, look, base, buffers, context);
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDisableClientState(GL_VERTEX_ARRAY);
  }
  std::uint64_t covered = 0;
  Image image = read_back(width, height, look, context, covered);
  check_gl();
  if (report != nullptr)
    *report = {look.structure ? 2 : 1, target.format(), covered};
  return image;
}

double render_gl_bytes(std::uint32_t width, std::uint32_t height) {
  return (3.0 + 16 + 4) * width * height + 16.0 * 16 * width;
}

} // namespace gewebe
