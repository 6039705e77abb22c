#include "gl/gl_shader_internal.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

// Textures on the shape at rest as a shader has them; the formulas stand in rest.h and
// solid_texture.h.

namespace gewebe::gl {
namespace {

constexpr const char* common_source = R"(
varying vec3 rest_place, rest_normal, now_place;
#ifdef TURNED
varying vec3 rotated_x, rotated_y;
#endif
vec3 across_x, across_y; // what the place changes by from pixel to pixel
vec3 at_rest_normal;
float footprint;
void find_rest() {
  // Over w places are linear on the picture, so that differences are exact, even those that a driver
  // takes once for four pixels.
  float near = gl_FragCoord.w;
  vec3 over = rest_place * near;
  across_x = (dFdx(over) - rest_place * dFdx(near)) / near;
  across_y = (dFdy(over) - rest_place * dFdy(near)) / near;
  footprint = sqrt(max(dot(across_x, across_x), dot(across_y, across_y)));
  at_rest_normal = unit(rest_normal);
}
vec3 light_at_rest() {
  vec3 l = light.w > 0.0 ? unit(light.xyz - now_place) : light.xyz;
#ifdef TURNED
  vec3 x = unit(rotated_x);
  vec3 y = unit(rotated_y - x * dot(x, rotated_y));
  l = vec3(dot(l, x), dot(l, y), dot(l, cross(x, y)));
#endif
  return l;
}
)";

constexpr const char* noise_source = R"(
uint scrambled(uint h) {
  h ^= h >> 16;
  h *= 0x7feb352du;
  h ^= h >> 15;
  h *= 0x846ca68bu;
  return h ^ (h >> 16);
}
float along_gradient(uint h, vec3 d) {
  int word = int(h);
  float first = word < -715827882 ? d.y : d.x;
  float second = word > 715827882 ? d.y : d.z;
  return ((h & 1u) != 0u ? -first : first) + ((h & 2u) != 0u ? -second : second);
}
float gradient_noise(vec3 x, uvec3 from, uint seed) {
  vec3 cell = floor(x);
  vec3 d = x - cell;
  vec3 u = d * d * d * (d * (d * 6.0 - 15.0) + 10.0);
  const uvec3 factor = uvec3(0x8da6b343u, 0xd8163841u, 0xcb1ab31fu);
  uvec3 a = (uvec3(ivec3(cell)) + from) * factor;
  uvec3 b = a + factor;
  a.z ^= seed;
  b.z ^= seed;
  vec3 e = d - 1.0;
  vec4 low = vec4(along_gradient(scrambled(a.x ^ a.y ^ a.z), d),
                  along_gradient(scrambled(a.x ^ b.y ^ a.z), vec3(d.x, e.y, d.z)),
                  along_gradient(scrambled(a.x ^ a.y ^ b.z), vec3(d.x, d.y, e.z)),
                  along_gradient(scrambled(a.x ^ b.y ^ b.z), vec3(d.x, e.y, e.z)));
  vec4 high = vec4(along_gradient(scrambled(b.x ^ a.y ^ a.z), vec3(e.x, d.y, d.z)),
                   along_gradient(scrambled(b.x ^ b.y ^ a.z), vec3(e.x, e.y, d.z)),
                   along_gradient(scrambled(b.x ^ a.y ^ b.z), vec3(e.x, d.y, e.z)),
                   along_gradient(scrambled(b.x ^ b.y ^ b.z), e));
  vec4 edges = mix(low, high, u.x);
  vec2 faces = mix(edges.xz, edges.yw, u.y);
  return mix(faces.x, faces.y, u.z);
}
)";

// For the texture that @ stands for, of @OCTAVES octaves.
constexpr const char* solid_source = R"(
uniform mat3 @rows;
uniform vec3 @part, @ground, @span, @shift[13];
uniform ivec3 @whole;
uniform int @seed[13];
uniform float @gain[13], @faded[13], @cells, @roughness, @width;
float @share(float cells, int k) {
#ifdef @FILTERED
  return clamp(1.5 - 2.0 * float(1 << k) * cells, 0.0, 1.0);
#else
  return 1.0;
#endif
}
float @octave(vec3 y, int k) {
  return gradient_noise(y * float(1 << k) + @shift[k], uvec3(@whole) << uint(k),
                        uint(@seed[k]));
}
float @value(vec3 place) {
  vec3 y = @rows * place + @part;
  float cells = footprint * @cells;
#ifdef @VEINS
  float clear = 1.0, reach = 1.0, share = @share(cells, 0);
  float next = share > 0.0 ? @octave(y, 0) : 0.0;
  for (int k = 0; k < @OCTAVES; ++k) {
    if (!(share > 0.0)) {
      clear *= 1.0 - @faded[k];
      continue;
    }
    float finer = @share(cells, k + 1);
    float m = next;
    if (finer > 0.0) {
      next = @octave(y, k + 1);
      m += @roughness * finer * next;
    }
    float w = @width * @width;
#ifdef @FILTERED
    w += float(1 << k) * cells * float(1 << k) * cells;
#endif
    float bump = max(1.0 - m * m / w, 0.0);
    clear *= 1.0 - (share * reach * bump * bump * @width / sqrt(w) + (1.0 - share) * @faded[k]);
    reach *= max(1.0 - m * m * REACH, 0.0);
    share = finer;
  }
  return 1.0 - clear;
#else
  float sum = 0.5;
  for (int k = 0; k < @OCTAVES; ++k) {
    float share = @share(cells, k);
    if (!(share > 0.0))
      break;
    sum += share * @gain[k] * @octave(y, k);
  }
  return clamp(sum, 0.0, 1.0);
#endif
}
vec3 @color() {
  return @ground + @value(rest_place) * @span;
}
)";

constexpr const char* triplanar_source = R"(
uniform vec4 projection; // q = place * w + xyz
float weight_of(float ratio) {
  float weight = 1.0;
  for (int rest = SHARPNESS; rest > 0; rest /= 2) {
    if (rest % 2 != 0)
      weight *= ratio;
    ratio *= ratio;
  }
  return max(weight - 1.0 / 256.0, 0.0);
}
vec3 weights() {
  vec3 n = abs(at_rest_normal);
  float largest = max(max(n.x, n.y), n.z);
  if (!(largest > 0.0))
    return vec3(0.0, 0.0, 1.0);
  n /= largest;
  vec3 w = vec3(weight_of(n.x), weight_of(n.y), weight_of(n.z));
  return w / (w.x + w.y + w.z);
}
vec3 signs() {
  return vec3(at_rest_normal.x < 0.0 ? -1.0 : 1.0, at_rest_normal.y < 0.0 ? 1.0 : -1.0,
              at_rest_normal.z < 0.0 ? -1.0 : 1.0);
}
// Coordinates along the axes: each s with the axis' sign.
vec2 projected(vec3 v, int axis) {
  return axis == 0 ? v.yz : axis == 1 ? v.xz : v.xy;
}
vec3 read_projected(sampler2D image, vec2 st, int axis) {
  return textureGrad(image, st, projected(across_x * projection.w, axis),
                     projected(across_y * projection.w, axis)).rgb;
}
vec2 projected_st(int axis) {
  vec2 st = projected(rest_place * projection.w + projection.xyz, axis);
  st.x *= signs()[axis];
  return st;
}
vec3 read_all(sampler2D image) {
  vec3 w = weights(), sum = vec3(0.0);
  for (int axis = 0; axis < 3; ++axis)
    if (w[axis] > 0.0)
      sum += w[axis] * read_projected(image, projected_st(axis), axis);
  return sum;
}
#ifdef REST_STRUCTURE
float read_relief(sampler2D image) {
  vec3 w = weights(), n = at_rest_normal, l = light_at_rest();
  float sum = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    if (w[axis] > 0.0) {
      vec3 t = unit(cross(axis == 2 ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0), n));
      vec2 shift = offset * vec2(dot(l, t), dot(l, cross(n, t)));
      vec2 st = projected_st(axis);
      sum += w[axis] * (0.5 + 0.5 * (read_projected(image, st, axis).r -
                                     read_projected(image, st + shift, axis).r));
    }
  return sum;
}
#endif
)";

std::string with_name(std::string_view source, const std::string& name) {
  std::string out;
  for (const char c : source)
    if (c == '@')
      out += name;
    else
      out += c;
  return out;
}

struct Layer {
  const char* name;
  const char* define;
  const std::optional<texture::Texture>& image;
  const std::optional<texture::SolidTexture>* solid;
};
std::array<Layer, 4> layers_of(const texture::SurfaceMaterial& material) {
  return {{{"base", "REST_BASE", material.base, &material.solid_base},
           {"detail", "REST_DETAIL", material.detail, &material.solid_detail},
           {"reflection", "REST_REFLECTION", material.reflection, nullptr},
           {"structure", "REST_STRUCTURE", material.structure, &material.solid_structure}}};
}

bool is_solid(const Layer& layer) {
  return layer.solid != nullptr && layer.solid->has_value();
}

} // namespace

std::string rest_definitions(const texture::SurfaceMaterial& material) {
  std::string head = "#define REST\n#define SHARPNESS " + std::to_string(material.rest.sharpness) +
                     "\n#define REACH " +
                     std::to_string(1 / (texture::vein_reach * texture::vein_reach)) + "\n";
  for (const Layer& layer : layers_of(material)) {
    if (!is_solid(layer) && !texture::is_triplanar(material, layer.image))
      continue;
    head += std::string("#define ") + layer.define + "\n";
    if (!is_solid(layer))
      continue;
    const texture::SolidTexture& solid = **layer.solid;
    head += with_name("#define @_OCTAVES ", layer.name) + std::to_string(solid.octaves) + "\n";
    head +=
        solid.kind == texture::SolidKind::veins ? with_name("#define @_VEINS\n", layer.name) : "";
    head += solid.filtered ? with_name("#define @_FILTERED\n", layer.name) : "";
  }
  return head;
}

std::string rest_source(const texture::SurfaceMaterial& material) {
  std::string source = common_source;
  bool noise = false, images = false;
  for (const Layer& layer : layers_of(material)) {
    noise = noise || is_solid(layer);
    images = images || texture::is_triplanar(material, layer.image);
  }
  source += noise ? noise_source : "";
  source += images ? triplanar_source : "";
  for (const Layer& layer : layers_of(material)) {
    const std::string name = layer.name;
    const bool relief = name == "structure";
    if (is_solid(layer)) {
      source += with_name(solid_source, name + "_");
      source += relief ? R"(
uniform float solid_shift;
float rest_relief() {
  vec3 l = light_at_rest();
  vec3 flat_ = l - at_rest_normal * dot(at_rest_normal, l);
  return 0.5 + 0.5 * (structure_value(rest_place) - structure_value(rest_place + flat_ * solid_shift));
}
)"
                       : "vec3 rest_" + name + "() { return " + name + "_color(); }\n";
    } else if (texture::is_triplanar(material, layer.image)) {
      source += relief ? "float rest_relief() { return read_relief(structure); }\n"
                       : "vec3 rest_" + name + "() { return read_all(" + name + "); }\n";
    }
  }
  return source;
}

void set_rest(GLuint program, const texture::SurfaceMaterial& material,
              const shading::Drawing& drawing) {
  const auto place = [&](const std::string& name) {
    return glGetUniformLocation(program, name.c_str());
  };
  const Vec3 part = (drawing.rest_origin - material.rest.start) / material.rest.edge;
  glUniform4f(place("projection"), static_cast<float>(part.x), static_cast<float>(part.y),
              static_cast<float>(part.z),
              static_cast<float>(drawing.rest_scale / material.rest.edge));
  glUniform1f(place("solid_shift"),
              static_cast<float>(drawing.offset[0] * material.rest.edge / drawing.rest_scale));
  for (const Layer& layer : layers_of(material)) {
    if (!is_solid(layer))
      continue;
    const std::string name = std::string(layer.name) + "_";
    const texture::SolidPlan plan =
        texture::solid_plan(**layer.solid, drawing.rest_origin, drawing.rest_scale);
    constexpr int octaves = texture::solid_octaves + 1;
    glUniformMatrix3fv(place(name + "rows"), 1, GL_TRUE, &plan.rows[0][0]);
    glUniform3fv(place(name + "part"), 1, plan.part);
    glUniform3fv(place(name + "ground"), 1, plan.ground);
    glUniform3fv(place(name + "span"), 1, plan.span);
    glUniform3fv(place(name + "shift"), octaves, &plan.shift[0][0]);
    glUniform1fv(place(name + "gain"), octaves, plan.gain);
    glUniform1fv(place(name + "faded"), octaves, plan.faded);
    glUniform1f(place(name + "cells"), plan.cells);
    glUniform1f(place(name + "roughness"), plan.roughness);
    glUniform1f(place(name + "width"), plan.width);
    std::array<GLint, octaves> seeds{};
    std::copy(std::begin(plan.seed), std::end(plan.seed), seeds.begin());
    glUniform1iv(place(name + "seed"), octaves, seeds.data());
    glUniform3i(place(name + "whole"), static_cast<GLint>(plan.whole[0]),
                static_cast<GLint>(plan.whole[1]), static_cast<GLint>(plan.whole[2]));
  }
}

} // namespace gewebe::gl
