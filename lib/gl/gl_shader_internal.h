#pragma once
// The emboss shader.

#include "shading/drawing.h"
#include "shading/look.h"

#include <epoxy/gl.h>

#include <string>

namespace gewebe {

/// Textures are bound to units in this order.
enum GlUnit { base_unit, detail_unit, reflection_unit, structure_unit };

/// A program for what `look` has, with frames or with what stands at the vertices; with textures on
/// the shape at rest (it needs GLSL 1.30 then), which may have been turned since.
class GlShader {
public:
  /// \throw Error if OpenGL has no GLSL 1.20 or can't compile it
  GlShader(const Look& look, bool frames, bool turned);
  ~GlShader();
  GlShader(const GlShader&) = delete;
  GlShader& operator=(const GlShader&) = delete;
  /// \pre `look` has textures as that which the program was made for, with values of its own
  void use(const Drawing& drawing, const Look& look) const;

private:
  GLuint program_ = 0;
};

// Of textures on the shape at rest (gl_shader_rest.cpp): head and body of a fragment shader that
// defines what `look` has as rest_base(), rest_detail(), rest_reflection() and rest_relief().
std::string rest_definitions(const Look& look);
std::string rest_source(const Look& look);
void set_rest(GLuint program, const Look& look, const Drawing& drawing);

} // namespace gewebe
