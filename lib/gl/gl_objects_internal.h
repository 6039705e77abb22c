#pragma once
// OpenGL's objects, deleted with their owners.

#include "base/context.h"
#include "shading/drawing.h"
#include "texture/surface_material.h"

#include <epoxy/gl.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::gl {

/// Objects of one kind.
class GlNames {
public:
  using Delete = void (*)(GLsizei, const GLuint*);
  explicit GlNames(Delete del) : delete_(del) {}
  ~GlNames() {
    if (!names_.empty())
      delete_(static_cast<GLsizei>(names_.size()), names_.data());
  }
  GlNames(const GlNames&) = delete;
  GlNames& operator=(const GlNames&) = delete;

  GLuint keep(GLuint name) {
    names_.push_back(name);
    return name;
  }

private:
  Delete delete_;
  std::vector<GLuint> names_;
};

class GlTextures {
public:
  GlTextures();
  GLuint load(const texture::Texture& texture, bool structure);
  /// Red, green, blue of the base, and half the structure as alpha, so that the sum of two stays
  /// below 1.
  GLuint load_joined(const std::optional<texture::Texture>& base,
                     const texture::Texture& structure);

private:
  GlNames names_;
};

/// A framebuffer of colours, depth and stencil, with one sample for reading.
class GlTarget {
public:
  GlTarget(std::uint32_t width, std::uint32_t height, bool wide, int samples);
  void bind() const;
  void resolve() const; ///< and bind for reading
  const std::string& format() const { return format_; }

private:
  bool make(GLuint framebuffer, GLenum colors, int samples, bool depth);
  GlNames framebuffers_, renderbuffers_;
  GLsizei width_, height_;
  GLuint drawn_ = 0, read_ = 0;
  std::string format_;
};

/// A drawing in buffers.
class GlGeometry {
public:
  GlGeometry(const shading::Drawing& drawing, const texture::SurfaceMaterial& material);
  /// Of one unit.
  void use_texcoords(int unit, std::size_t offset, int count) const;
  void use_frames() const; ///< normals; tangent and side as coordinates of unit 1
  /// Places and normals at rest as coordinates of units 3 and 4, turns of 5 and 6 where there are
  /// any.
  void use_rests() const;
  void use_colors(const texture::SurfaceMaterial& material)
      const; ///< those of the vertices, times the material's
  void no_colors() const;
  void draw(std::size_t first, std::size_t count, const Context& context) const; ///< triangles

private:
  GlNames buffers_;
  GLuint vertices_ = 0, frames_ = 0, rests_ = 0, turns_ = 0, indices_ = 0;
  std::vector<std::pair<Vec3, GLuint>>
      colors_; ///< where vertices are shaded, by the material's colour
};

void check_gl();
void stop_if_cancelled(const Context& context);

} // namespace gewebe::gl
