#pragma once
// The emboss shader.

#include "shading/drawing.h"
#include "texture/surface_material.h"

#include <epoxy/gl.h>

#include <string>

namespace gewebe::gl {

/// Textures are bound to units in this order.
enum GlUnit { base_unit, detail_unit, reflection_unit, structure_unit };

/// A program for what `material` has, with frames or with what stands at the vertices; with
/// textures on the shape at rest (it needs GLSL 1.30 then), which may have been turned since.
class GlShader {
public:
  /// \throw Error if OpenGL has no GLSL 1.20 or can't compile it
  GlShader(const texture::SurfaceMaterial& material, bool frames, bool rotated);
  ~GlShader();
  GlShader(const GlShader&) = delete;
  GlShader& operator=(const GlShader&) = delete;
  /// \param surroundings what a film mirrors
  /// \pre `material` has textures as that which the program was made for, with values of its own
  void use(const shading::Drawing& drawing, const texture::SurfaceMaterial& material,
           const Vec3& surroundings) const;

private:
  GLuint program_ = 0;
};

// Of textures on the shape at rest (gl_shader_rest.cpp): head and body of a fragment shader that
// defines what `material` has as rest_base(), rest_detail(), rest_reflection() and rest_relief().
std::string rest_definitions(const texture::SurfaceMaterial& material);
std::string rest_source(const texture::SurfaceMaterial& material);
void set_rest(GLuint program, const texture::SurfaceMaterial& material,
              const shading::Drawing& drawing);

} // namespace gewebe::gl
