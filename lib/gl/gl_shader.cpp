#include "gl/gl_shader_internal.h"

#include "base/error.h"

#include <array>
#include <string>

// Based on: report FZKA 7190, 2006, section 3.2.3, with the frame of eq. 3.2 at each pixel.

namespace gewebe::gl {
namespace {

constexpr const char* vertex_source = R"(
varying vec2 st;
varying vec4 primary;
#ifdef FRAMES
varying vec3 place, normal;
varying vec4 tangent;
#else
varying vec2 shifted, mirrored;
#endif
#ifdef REST
varying vec3 rest_place, rest_normal, now_place;
#endif
#ifdef TURNED
varying vec3 rotated_x, rotated_y;
#endif
void main() {
  gl_Position = gl_ModelViewProjectionMatrix * gl_Vertex;
  st = gl_MultiTexCoord0.xy;
  primary = gl_Color;
#ifdef FRAMES
  place = gl_Vertex.xyz;
  normal = gl_Normal;
  tangent = gl_MultiTexCoord1;
#else
  shifted = gl_MultiTexCoord1.xy;
  mirrored = gl_MultiTexCoord2.xy;
#endif
#ifdef REST
  rest_place = gl_MultiTexCoord3.xyz;
  rest_normal = gl_MultiTexCoord4.xyz;
  now_place = gl_Vertex.xyz;
#endif
#ifdef TURNED
  rotated_x = gl_MultiTexCoord5.xyz;
  rotated_y = gl_MultiTexCoord6.xyz;
#endif
})";

// Before what textures at rest need.
constexpr const char* fragment_head = R"(
uniform sampler2D base, detail, reflection, structure;
uniform vec4 light; // w: 0 for a direction
uniform vec2 offset;
vec3 unit(vec3 v) {
  float l = length(v);
  return l > 0.0 ? v / l : vec3(0.0);
}
#ifdef FILM
uniform vec4 film; // amount, a², F0, where the light is full
uniform vec3 mirrored_color;
float mirrored_share(float cosine) {
  return film.z + (1.0 - film.z) * pow(1.0 - min(cosine, 1.0), 5.0);
}
float smith(float x) {
  return x + sqrt(film.y + (1.0 - film.y) * x * x);
}
vec3 wet(vec3 c, vec3 n, vec3 v, vec3 l, float twice_relief, float left) {
  n = dot(n, v) < 0.0 ? -n : n;
  n = unit(n + (twice_relief - 1.0) * unit(l - n * dot(l, n)));
  vec3 h = unit(v + l);
  float nv = max(dot(n, v), 0.0), nl = max(dot(n, l), 0.0), nh = max(dot(n, h), 0.0);
  float spread = nh * nh * (film.y - 1.0) + 1.0;
  float light_mirrored =
      film.y * mirrored_share(max(dot(v, h), 0.0)) * nl * left / (spread * spread * smith(nl) * smith(nv));
  return min(c + film.x * (mirrored_share(nv) * (mirrored_color - c) + light_mirrored), 1.0);
}
#endif
)";

constexpr const char* fragment_source = R"(
uniform vec3 eye, right, up, back;
varying vec2 st;
varying vec4 primary;
#ifdef FRAMES
varying vec3 place, normal;
varying vec4 tangent;
#else
varying vec2 shifted, mirrored;
#endif
void main() {
  vec2 shift = vec2(0.0), around = vec2(0.0);
#ifdef FRAMES
  vec3 n = unit(normal);
#ifdef STRUCTURE
  vec3 t = unit(tangent.xyz - n * dot(n, tangent.xyz));
  vec3 l = light.w > 0.0 ? unit(light.xyz - place) : light.xyz;
  shift = offset * vec2(dot(l, t), tangent.w * dot(l, cross(n, t)));
#endif
#ifdef SPHERE
  vec3 v = unit(place - eye);
  vec3 r = v - 2.0 * dot(n, v) * n;
  vec3 m = vec3(dot(r, right), dot(r, up), dot(r, back) + 1.0);
  float len = length(m);
  around = len > 0.0 ? m.xy * (0.5 / len) + 0.5 : vec2(0.5);
#endif
#else
  shift = shifted - st;
  around = mirrored;
#endif
  vec3 c = primary.rgb;
#ifdef REST
  find_rest();
#endif
#ifdef BASE
  c *= texture2D(base, BASE).rgb;
#endif
#ifdef REST_BASE
  c *= rest_base();
#endif
#ifdef DETAIL
  c = min(c + texture2D(detail, DETAIL).rgb, 1.0);
#endif
#ifdef REST_DETAIL
  c = min(c + rest_detail(), 1.0);
#endif
#ifdef REFLECTION
  c = min(c + texture2D(reflection, REFLECTION).rgb, 1.0);
#endif
#ifdef REST_REFLECTION
  c = min(c + rest_reflection(), 1.0);
#endif
  float relief = 0.5;
#ifdef REST_STRUCTURE
  relief = rest_relief();
#endif
#ifdef STRUCTURE
  relief = 0.5 + 0.5 * (texture2D(structure, STRUCTURE).r - texture2D(structure, STRUCTURE + shift).r);
#endif
  c = min(2.0 * relief * c, 1.0);
#ifdef FILM
  c = wet(c, n, unit(eye - place), light.w > 0.0 ? unit(light.xyz - place) : light.xyz, 2.0 * relief,
          film.w > 0.0 ? min(film.w / length(light.xyz - place), 1.0) : 1.0);
#endif
  gl_FragColor = vec4(c, 1.0);
})";

GLuint compiled(GLenum kind, const std::string& source) {
  const GLuint shader = glCreateShader(kind);
  const char* const text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint ok = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == GL_TRUE)
    return shader;
  std::array<char, 200> log{};
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
  glDeleteShader(shader);
  std::string line(log.data());
  line.resize(std::min(line.find('\n'), line.size()));
  throw Error("OpenGL can't compile the shader (" + line +
              "), expected GLSL 1.20, or 1.30 for textures at rest");
}

void set(GLuint program, const char* name, const Vec3& v) {
  glUniform3f(glGetUniformLocation(program, name), static_cast<float>(v.x), static_cast<float>(v.y),
              static_cast<float>(v.z));
}

} // namespace

GlShader::GlShader(const texture::SurfaceMaterial& material, bool frames, bool rotated) {
  const bool rest = texture::is_at_rest(material);
  std::string head = rest ? "#version 130\n" + rest_definitions(material) : "#version 120\n";
  head += rest && rotated ? "#define TURNED\n" : "";
  bool sphere = false;
  const auto define = [&](const std::optional<texture::Texture>& texture, const char* name) {
    if (!texture || texture::is_triplanar(material, texture))
      return;
    sphere = sphere || texture->options.sphere;
    head += std::string("#define ") + name + (texture->options.sphere ? " around\n" : " st\n");
  };
  define(material.base, "BASE");
  define(material.detail, "DETAIL");
  define(material.reflection, "REFLECTION");
  define(material.structure, "STRUCTURE");
  head += std::string(sphere ? "#define SPHERE\n" : "") + (frames ? "#define FRAMES\n" : "") +
          (material.film.amount > 0 ? "#define FILM\n" : "");
  const GLuint vertex = compiled(GL_VERTEX_SHADER, head + vertex_source);
  const GLuint fragment =
      compiled(GL_FRAGMENT_SHADER,
               head + fragment_head + (rest ? rest_source(material) : "") + fragment_source);
  program_ = glCreateProgram();
  for (const GLuint shader : {vertex, fragment}) {
    glAttachShader(program_, shader);
    glDeleteShader(shader);
  }
  glLinkProgram(program_);
  GLint ok = GL_FALSE;
  glGetProgramiv(program_, GL_LINK_STATUS, &ok);
  if (ok != GL_TRUE) {
    glDeleteProgram(program_);
    throw Error("OpenGL can't link the shader, expected GLSL 1.20");
  }
}

GlShader::~GlShader() {
  glDeleteProgram(program_);
}

void GlShader::use(const shading::Drawing& drawing, const texture::SurfaceMaterial& material,
                   const Vec3& surroundings) const {
  glUseProgram(program_);
  int unit = 0;
  for (const char* name : {"base", "detail", "reflection", "structure"})
    glUniform1i(glGetUniformLocation(program_, name), unit++);
  glUniform4f(glGetUniformLocation(program_, "light"), static_cast<float>(drawing.light.x),
              static_cast<float>(drawing.light.y), static_cast<float>(drawing.light.z),
              drawing.directional ? 0.0F : 1.0F);
  glUniform2f(glGetUniformLocation(program_, "offset"), static_cast<float>(drawing.offset[0]),
              static_cast<float>(drawing.offset[1]));
  set(program_, "eye", drawing.camera.eye);
  set(program_, "right", drawing.camera.right);
  set(program_, "up", drawing.camera.up);
  set(program_, "back", drawing.camera.back);
  const double alpha = material.film.roughness * material.film.roughness;
  glUniform4f(glGetUniformLocation(program_, "film"), static_cast<float>(material.film.amount),
              static_cast<float>(alpha * alpha), static_cast<float>(material.film.reflectance),
              static_cast<float>(drawing.full_distance));
  set(program_, "mirrored_color", surroundings);
  if (texture::is_at_rest(material))
    set_rest(program_, material, drawing);
}

} // namespace gewebe::gl
