#include "gl/gl_objects_internal.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace gewebe::gl {
namespace {

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

GLint wrap_of(texture::TextureWrap wrap) {
  return wrap == texture::TextureWrap::repeat  ? GL_REPEAT
         : wrap == texture::TextureWrap::clamp ? GL_CLAMP_TO_EDGE
                                               : GL_MIRRORED_REPEAT;
}

GLuint new_texture(GlNames& names, const texture::TextureOptions& options, std::size_t levels) {
  GLuint name = 0;
  glGenTextures(1, &name);
  names.keep(name);
  glBindTexture(GL_TEXTURE_2D, name);
  const GLint near = options.filter == texture::TextureFilter::nearest ? GL_NEAREST : GL_LINEAR;
  const GLint far =
      options.filter == texture::TextureFilter::mipmap ? GL_LINEAR_MIPMAP_LINEAR : near;
  for (const auto& [parameter, value] : {std::pair<GLenum, GLint>{GL_TEXTURE_MIN_FILTER, far},
                                         {GL_TEXTURE_MAG_FILTER, near},
                                         {GL_TEXTURE_WRAP_S, wrap_of(options.wrap)},
                                         {GL_TEXTURE_WRAP_T, wrap_of(options.wrap)},
                                         {GL_TEXTURE_MAX_LEVEL, static_cast<GLint>(levels) - 1}})
    glTexParameteri(GL_TEXTURE_2D, parameter, value);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  return name;
}

GLuint new_buffer(GlNames& names, GLenum target, const void* data, std::size_t bytes) {
  GLuint name = 0;
  glGenBuffers(1, &name);
  names.keep(name);
  glBindBuffer(target, name);
  glBufferData(target, static_cast<GLsizeiptr>(bytes), data, GL_STATIC_DRAW);
  return name;
}

/// OpenGL takes offsets into buffers as pointers.
const void* at(std::size_t offset) {
  return reinterpret_cast<const void*>(offset); // NOLINT(performance-no-int-to-ptr)
}

} // namespace

GlTextures::GlTextures() : names_(delete_textures) {}

GLuint GlTextures::load(const texture::Texture& texture, bool structure) {
  const GLuint name = new_texture(names_, texture.options, texture.levels.size());
  for (std::size_t n = 0; n < texture.levels.size(); ++n) {
    const texture::TextureLevel& level = texture.levels[n];
    const auto w = static_cast<GLsizei>(level.width), h = static_cast<GLsizei>(level.height);
    const std::uint32_t* const texels = texture.texels->data() + level.first;
    if (texture.channels == 1) {
      std::vector<std::uint16_t> gray(std::size_t{level.width} * level.height);
      for (std::size_t t = 0; t < gray.size(); ++t)
        gray[t] = static_cast<std::uint16_t>(texels[t]);
      glTexImage2D(GL_TEXTURE_2D, static_cast<GLint>(n),
                   structure ? GL_INTENSITY16 : GL_LUMINANCE16, w, h, 0, GL_LUMINANCE,
                   GL_UNSIGNED_SHORT, gray.data());
    } else {
      glTexImage2D(GL_TEXTURE_2D, static_cast<GLint>(n), GL_RGB8, w, h, 0, GL_RGBA,
                   GL_UNSIGNED_BYTE, texels);
    }
  }
  return name;
}

GLuint GlTextures::load_joined(const std::optional<texture::Texture>& base,
                               const texture::Texture& structure) {
  const texture::Texture& lead = base ? *base : structure;
  const bool same =
      !base || (base->width() == structure.width() && base->height() == structure.height());
  const GLuint name = new_texture(names_, lead.options, lead.levels.size());
  std::uint32_t width = structure.width(), height = structure.height();
  if (base) {
    width = std::max(width, base->width());
    height = std::max(height, base->height());
  }
  for (std::size_t n = 0; n < lead.levels.size(); ++n) {
    const std::uint32_t w = std::max(1U, width >> n), h = std::max(1U, height >> n);
    std::vector<std::uint16_t> texels;
    texels.reserve(std::size_t{4} * w * h);
    const auto value = [&](const texture::Texture& texture, std::uint32_t x, std::uint32_t y) {
      return same ? texture::texel(texture, n, x, y)
                  : texture::sample(texture, (x + 0.5) / w, (y + 0.5) / h);
    };
    for (std::uint32_t y = 0; y < h; ++y)
      for (std::uint32_t x = 0; x < w; ++x) {
        const std::array<double, 3> color =
            base ? value(*base, x, y) : std::array<double, 3>{1, 1, 1};
        for (const double c : color)
          texels.push_back(static_cast<std::uint16_t>(std::floor(c * 65535 + 0.5)));
        texels.push_back(
            static_cast<std::uint16_t>(std::floor(value(structure, x, y)[0] * 32767.5 + 0.5)));
      }
    glTexImage2D(GL_TEXTURE_2D, static_cast<GLint>(n), GL_RGBA16, static_cast<GLsizei>(w),
                 static_cast<GLsizei>(h), 0, GL_RGBA, GL_UNSIGNED_SHORT, texels.data());
  }
  return name;
}

GlTarget::GlTarget(std::uint32_t width, std::uint32_t height, bool wide, int samples)
    : framebuffers_(delete_framebuffers), renderbuffers_(delete_renderbuffers),
      width_(static_cast<GLsizei>(width)), height_(static_cast<GLsizei>(height)) {
  glGenFramebuffers(1, &drawn_);
  read_ = framebuffers_.keep(drawn_);
  if (samples > 1) {
    glGenFramebuffers(1, &read_);
    framebuffers_.keep(read_);
  }
  const std::vector<std::pair<GLenum, const char*>> formats =
      wide ? std::vector<std::pair<GLenum, const char*>>{{GL_RGBA32F, "RGBA32F"},
                                                         {GL_RGBA16F, "RGBA16F"}}
           : std::vector<std::pair<GLenum, const char*>>{{GL_RGBA8, "RGBA8"}};
  for (const auto& [format, name] : formats)
    if (make(drawn_, format, samples, true) && (samples == 1 || make(read_, format, 1, false))) {
      format_ = name;
      bind();
      return;
    }
  throw Error("OpenGL gives no target of " + std::to_string(width) + " x " +
              std::to_string(height) + " pixels with " + std::to_string(samples) +
              " samples, expected one");
}

bool GlTarget::make(GLuint framebuffer, GLenum colors, int samples, bool depth) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  const auto attach = [&](GLenum format, GLenum where) {
    GLuint buffer = 0;
    glGenRenderbuffers(1, &buffer);
    renderbuffers_.keep(buffer);
    glBindRenderbuffer(GL_RENDERBUFFER, buffer);
    glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples > 1 ? samples : 0, format, width_,
                                     height_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, where, GL_RENDERBUFFER, buffer);
  };
  attach(colors, GL_COLOR_ATTACHMENT0);
  if (depth)
    attach(GL_DEPTH24_STENCIL8, GL_DEPTH_STENCIL_ATTACHMENT);
  return glGetError() == GL_NO_ERROR &&
         glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

void GlTarget::bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, drawn_);
}

void GlTarget::resolve() const {
  if (read_ != drawn_) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, drawn_);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, read_);
    glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT,
                      GL_NEAREST);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, read_);
}

GlGeometry::GlGeometry(const shading::Drawing& drawing, const texture::SurfaceMaterial& material)
    : buffers_(delete_buffers) {
  vertices_ = new_buffer(buffers_, GL_ARRAY_BUFFER, drawing.vertices.data(),
                         drawing.vertices.size() * sizeof(shading::DrawVertex));
  if (!drawing.frames.empty())
    frames_ = new_buffer(buffers_, GL_ARRAY_BUFFER, drawing.frames.data(),
                         drawing.frames.size() * sizeof(shading::DrawFrame));
  if (!drawing.rests.empty())
    rests_ = new_buffer(buffers_, GL_ARRAY_BUFFER, drawing.rests.data(),
                        drawing.rests.size() * sizeof(texture::DrawRest));
  if (!drawing.turns.empty())
    turns_ = new_buffer(buffers_, GL_ARRAY_BUFFER, drawing.turns.data(),
                        drawing.turns.size() * sizeof(texture::DrawTurn));
  if (std::ranges::any_of(drawing.vertices,
                          [](const shading::DrawVertex& v) { return v.shade != 1.0F; }))
    for (std::size_t g = 0; g < shading::group_count(drawing); ++g) {
      const Vec3& color = texture::material_of_group(material, g).color;
      if (std::ranges::any_of(colors_, [&](const auto& c) { return c.first == color; }))
        continue;
      std::vector<std::array<float, 4>> colors;
      colors.reserve(drawing.vertices.size());
      for (const shading::DrawVertex& v : drawing.vertices)
        colors.push_back({static_cast<float>(color.x * double{v.shade}),
                          static_cast<float>(color.y * double{v.shade}),
                          static_cast<float>(color.z * double{v.shade}), 1.0F});
      colors_.emplace_back(color, new_buffer(buffers_, GL_ARRAY_BUFFER, colors.data(),
                                             colors.size() * sizeof colors[0]));
    }
  indices_ = new_buffer(buffers_, GL_ELEMENT_ARRAY_BUFFER, drawing.triangles.data(),
                        drawing.triangles.size() * sizeof(Triangle));
  glBindBuffer(GL_ARRAY_BUFFER, vertices_); // what pointers count from
  glEnableClientState(GL_VERTEX_ARRAY);
  glVertexPointer(3, GL_FLOAT, sizeof(shading::DrawVertex),
                  at(offsetof(shading::DrawVertex, position)));
}

void GlGeometry::use_texcoords(int unit, std::size_t offset, int count) const {
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glClientActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glEnableClientState(GL_TEXTURE_COORD_ARRAY);
  glTexCoordPointer(count, GL_FLOAT, sizeof(shading::DrawVertex), at(offset));
}

void GlGeometry::use_frames() const {
  glBindBuffer(GL_ARRAY_BUFFER, frames_);
  glEnableClientState(GL_NORMAL_ARRAY);
  glNormalPointer(GL_FLOAT, sizeof(shading::DrawFrame), at(offsetof(shading::DrawFrame, normal)));
  glClientActiveTexture(GL_TEXTURE1);
  glEnableClientState(GL_TEXTURE_COORD_ARRAY);
  glTexCoordPointer(4, GL_FLOAT, sizeof(shading::DrawFrame),
                    at(offsetof(shading::DrawFrame, tangent)));
}

void GlGeometry::use_rests() const {
  const auto use = [](GLenum unit, GLsizei stride, std::size_t offset) {
    glClientActiveTexture(GL_TEXTURE0 + unit);
    glEnableClientState(GL_TEXTURE_COORD_ARRAY);
    glTexCoordPointer(3, GL_FLOAT, stride, at(offset));
  };
  glBindBuffer(GL_ARRAY_BUFFER, rests_);
  use(3, sizeof(texture::DrawRest), offsetof(texture::DrawRest, place));
  use(4, sizeof(texture::DrawRest), offsetof(texture::DrawRest, normal));
  if (turns_ == 0)
    return;
  glBindBuffer(GL_ARRAY_BUFFER, turns_);
  use(5, sizeof(texture::DrawTurn), offsetof(texture::DrawTurn, x));
  use(6, sizeof(texture::DrawTurn), offsetof(texture::DrawTurn, y));
}

void GlGeometry::use_colors(const texture::SurfaceMaterial& material) const {
  glColor4d(material.color.x, material.color.y, material.color.z, 1);
  for (const auto& [color, buffer] : colors_)
    if (color == material.color) {
      glBindBuffer(GL_ARRAY_BUFFER, buffer);
      glEnableClientState(GL_COLOR_ARRAY);
      glColorPointer(4, GL_FLOAT, 0, nullptr);
    }
}

void GlGeometry::no_colors() const {
  glDisableClientState(GL_COLOR_ARRAY);
}

void GlGeometry::draw(std::size_t first, std::size_t count, const Context& context) const {
  constexpr std::size_t piece = 3U << 20; // indices
  const std::size_t end = 3 * (first + count);
  for (std::size_t from = 3 * first; from < end; from += piece) {
    stop_if_cancelled(context);
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(std::min(piece, end - from)), GL_UNSIGNED_INT,
                   at(from * sizeof(std::uint32_t)));
  }
}

void check_gl() {
  const GLenum error = glGetError();
  if (error == GL_OUT_OF_MEMORY)
    throw Error("OpenGL is out of memory, expected a smaller picture, mesh or texture");
  if (error != GL_NO_ERROR)
    throw Error("OpenGL failed with error " + std::to_string(error) + ", expected none");
}

void stop_if_cancelled(const Context& context) {
  if (context.cancelled && context.cancelled())
    throw Cancelled();
}

} // namespace gewebe::gl
