#pragma once
// The emboss shader.

#include "render/drawing.h"
#include "render/look.h"

#include <epoxy/gl.h>

namespace gewebe {

/// Textures are bound to units in this order.
enum GlUnit { base_unit, detail_unit, reflection_unit, structure_unit };

/// A program for what `look` has, with frames or with what stands at the vertices.
class GlShader {
public:
  /// \throw Error if OpenGL has no GLSL 1.20 or can't compile it
  GlShader(const Look& look, bool frames);
  ~GlShader();
  GlShader(const GlShader&) = delete;
  GlShader& operator=(const GlShader&) = delete;
  void use(const Drawing& drawing) const;

private:
  GLuint program_ = 0;
};

} // namespace gewebe
