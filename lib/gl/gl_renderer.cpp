#include "gl/gl_renderer.h"

#include "base/error.h"
#include "gl/gl_objects_internal.h"
#include "gl/gl_shader_internal.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

// Based on: report FZKA 7190, 2006, section 3.2.4, render-pass-3, -2 and -1.

namespace gewebe::gl {
namespace {

void set_env(GLenum name, GLenum value) {
  glTexEnvi(GL_TEXTURE_ENV, name, static_cast<GLint>(value));
}

void set_matrices(const shading::Projection& projection) {
  std::array<double, 16> columns{};
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      columns[4 * column + row] = projection.matrix[row][column];
  glMatrixMode(GL_PROJECTION);
  glLoadMatrixd(columns.data());
  glMatrixMode(GL_MODELVIEW);
  glLoadIdentity();
}

/// One source of a combining unit: which, and what of it.
struct Source {
  GLenum from, what;
};
void combine(GLenum target, GLenum function, std::initializer_list<Source> sources) {
  const bool rgb = target == GL_COMBINE_RGB;
  set_env(GL_TEXTURE_ENV_MODE, GL_COMBINE);
  set_env(target, function);
  GLenum n = 0;
  for (const Source& source : sources) {
    set_env((rgb ? GL_SRC0_RGB : GL_SRC0_ALPHA) + n, source.from);
    set_env((rgb ? GL_OPERAND0_RGB : GL_OPERAND0_ALPHA) + n, source.what);
    ++n;
  }
}

/// What the program of a GlShader depends on, besides the drawing.
std::string shader_kind(const texture::SurfaceMaterial& material) {
  unsigned kind = 0;
  for (const auto* texture :
       {&material.base, &material.detail, &material.reflection, &material.structure})
    kind = 4 * kind + (*texture ? ((*texture)->options.sphere ? 3U : 1U) : 0U);
  return std::to_string(kind) + (material.film.amount > 0 ? "wet" : "") +
         (texture::is_at_rest(material) ? rest_definitions(material) : "");
}

// At most so many passes blend into one group.
constexpr int max_blended = 16;

} // namespace

const std::vector<std::string>& gl_mode_names() {
  static const std::vector<std::string> names{"3", "2", "1", "shader"};
  return names;
}

GlMode gl_mode_from_name(std::string_view name) {
  const auto found = std::ranges::find(gl_mode_names(), name);
  if (found == gl_mode_names().end())
    throw Error("mode '" + std::string(name) + "' is unknown");
  return static_cast<GlMode>(found - gl_mode_names().begin());
}

struct GlRenderer::State {
  State(GlContext& gl, const texture::SurfaceMaterial& l, std::uint32_t w, std::uint32_t h,
        const GlOptions& o)
      : material(l), options(o), width(w), height(h), target(check(gl), h, o.wide, o.samples) {}

  /// The width, after a look at all sides.
  std::uint32_t check(const GlContext& gl) const {
    const auto at_most = [&](const char* what, std::uint32_t w, std::uint32_t h) {
      if (std::max(w, h) > static_cast<std::uint32_t>(gl.max_side()))
        throw Error(std::string(what) + " of " + std::to_string(w) + " x " + std::to_string(h) +
                    " exceeds this OpenGL, expected sides up to " + std::to_string(gl.max_side()));
    };
    at_most("a picture", width, height);
    for (std::size_t g = 0; g <= material.others.size(); ++g) {
      const texture::SurfaceMaterial& own = texture::material_of_group(material, g);
      for (const auto* texture : {&own.base, &own.detail, &own.reflection, &own.structure})
        if (*texture)
          at_most("a texture", (*texture)->width(), (*texture)->height());
    }
    return width;
  }

  /// Triangles with their material and its textures.
  struct Group {
    const texture::SurfaceMaterial* material = nullptr;
    GLuint base = 0, detail = 0, reflection = 0, structure = 0, joined = 0;
    std::size_t first = 0, count = 0; ///< triangles
  };

  GLuint load(const std::optional<texture::Texture>& texture, bool is_structure);
  void load_textures();
  void draw_group(const Context& context);
  void use(int unit, GLuint texture, const std::optional<texture::Texture>& layer,
           bool shifted = false);
  void drop_units();
  int use_colors(int unit);
  void next_pass(GLenum source, GLenum destination);
  void draw_geometry(const Context& context);
  void draw_relief(const std::array<float, 4>& half, const Context& context);
  void draw_three(const Context& context);
  void draw_three_layered(const Context& context);
  void draw_two(const Context& context);
  void draw_one(const Context& context);
  void draw_shader(const Context& context);

  texture::SurfaceMaterial material;
  GlOptions options;
  std::uint32_t width, height;
  GlTarget target;
  GlTextures textures;
  using Texels = const void*;
  std::map<std::pair<Texels, Texels>, GLuint> loaded, joined;
  std::vector<Group> groups;
  const Group* now = nullptr; ///< the group that is drawn
  std::optional<GlGeometry> geometry;
  std::map<std::string, GlShader> shaders; ///< by shader_kind
  shading::Drawing light;                  ///< without its vertices
  int units = 0;                           ///< in use
  int blended = 0;                         ///< what the stencil holds where the next pass may blend
  int passes = 0;
};

/// A texture that several groups share is loaded once.
GLuint GlRenderer::State::load(const std::optional<texture::Texture>& texture, bool is_structure) {
  if (!texture)
    return 0;
  GLuint& name = loaded[{texture->texels.get(), is_structure ? texture->texels.get() : nullptr}];
  if (name == 0)
    name = textures.load(*texture, is_structure);
  return name;
}

void GlRenderer::State::load_textures() {
  for (std::size_t g = 0; g <= material.others.size(); ++g) {
    const texture::SurfaceMaterial& own = texture::material_of_group(material, g);
    Group& group = groups.emplace_back();
    group.material = &own;
    const bool join = options.mode == GlMode::passes1 && own.structure;
    if (join) {
      if (own.base && own.base->options.sphere != own.structure->options.sphere)
        throw Error("one pass keeps base and structure in one texture, expected both "
                    "sphere-mapped or neither");
      GLuint& name =
          joined[{own.base ? own.base->texels.get() : nullptr, own.structure->texels.get()}];
      if (name == 0)
        name = textures.load_joined(own.base, *own.structure);
      group.joined = name;
    }
    if (!join)
      group.base = load(own.base, false);
    group.detail = load(own.detail, false);
    group.reflection = load(own.reflection, false);
    if (!join)
      group.structure = load(own.structure, true);
  }
}

void GlRenderer::State::use(int unit, GLuint texture, const std::optional<texture::Texture>& layer,
                            bool shifted) {
  glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  glEnable(GL_TEXTURE_2D);
  glBindTexture(GL_TEXTURE_2D, texture);
  set_env(GL_RGB_SCALE, 1);
  geometry->use_texcoords(unit,
                          shifted                          ? offsetof(shading::DrawVertex, shifted)
                          : layer && layer->options.sphere ? offsetof(shading::DrawVertex, sphere)
                                                           : offsetof(shading::DrawVertex, st),
                          2);
  units = std::max(units, unit + 1);
}

void GlRenderer::State::drop_units() {
  for (int unit = units; unit-- > 0;) {
    glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    glDisable(GL_TEXTURE_2D);
    glClientActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    glDisableClientState(GL_TEXTURE_COORD_ARRAY);
  }
  units = 0;
}

/// min(1, min(1, base + detail) + reflection) by units from `unit` on; the next free one.
int GlRenderer::State::use_colors(int unit) {
  if (now->material->base && now->base != 0) {
    use(unit++, now->base, now->material->base);
    set_env(GL_TEXTURE_ENV_MODE, GL_MODULATE);
  }
  for (const auto& [layer, name] : {std::pair{&now->material->detail, now->detail},
                                    {&now->material->reflection, now->reflection}})
    if (*layer) {
      use(unit++, name, *layer);
      combine(GL_COMBINE_RGB, GL_ADD, {{GL_PREVIOUS, GL_SRC_COLOR}, {GL_TEXTURE, GL_SRC_COLOR}});
      combine(GL_COMBINE_ALPHA, GL_REPLACE, {{GL_PREVIOUS, GL_SRC_ALPHA}});
    }
  return unit;
}

/// Blends where the surface of the first pass is seen, once a pixel and pass: the stencil keeps
/// coincident faces from being blended twice.
void GlRenderer::State::next_pass(GLenum source, GLenum destination) {
  glDepthFunc(GL_EQUAL);
  glEnable(GL_BLEND);
  glBlendFunc(source, destination);
  glEnable(GL_STENCIL_TEST);
  glStencilFunc(GL_EQUAL, blended++, 0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_INCR);
}

void GlRenderer::State::draw_geometry(const Context& context) {
  ++passes;
  geometry->draw(now->first, now->count, context);
  drop_units();
  geometry->no_colors();
}

/// Half of f, then half of 1 - f' added, in two passes; `half` has 1/2 where it is needed.
void GlRenderer::State::draw_relief(const std::array<float, 4>& half, const Context& context) {
  use(0, now->structure, now->material->structure);
  set_env(GL_TEXTURE_ENV_MODE, GL_MODULATE);
  glColor4fv(half.data());
  draw_geometry(context);
  next_pass(GL_ONE, GL_ONE);
  use(0, now->structure, now->material->structure, true);
  constexpr std::array<float, 4> black{};
  glTexEnvfv(GL_TEXTURE_ENV, GL_TEXTURE_ENV_COLOR, black.data());
  set_env(GL_TEXTURE_ENV_MODE, GL_BLEND);
  glColor4fv(half.data());
  draw_geometry(context);
}

/// f / 2, then (1 - f') / 2 added, then the base blended: c times what stands there, plus what
/// stands there times c.
void GlRenderer::State::draw_three(const Context& context) {
  draw_relief({0.5F, 0.5F, 0.5F, 1}, context);
  next_pass(GL_DST_COLOR, GL_SRC_COLOR);
  geometry->use_colors(*now->material);
  use_colors(0);
  draw_geometry(context);
}

/// With one unit the colours must be summed first: r goes to alpha, and both are multiplied at
/// last.
void GlRenderer::State::draw_three_layered(const Context& context) {
  geometry->use_colors(*now->material);
  if (now->material->base) {
    use(0, now->base, now->material->base);
    set_env(GL_TEXTURE_ENV_MODE, GL_MODULATE);
  }
  draw_geometry(context);
  const auto white = [&](GLenum source, GLenum destination) {
    next_pass(source, destination);
    glColor4f(1, 1, 1, 1);
    draw_geometry(context);
  };
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_FALSE);
  for (const auto& [layer, name] : {std::pair{&now->material->detail, now->detail},
                                    {&now->material->reflection, now->reflection}})
    if (*layer) {
      next_pass(GL_ONE, GL_ONE);
      use(0, name, *layer);
      set_env(GL_TEXTURE_ENV_MODE, GL_REPLACE);
      draw_geometry(context);
      if (options.wide) { // floats are not clamped
        glBlendEquation(GL_MIN);
        white(GL_ONE, GL_ONE);
        glBlendEquation(GL_FUNC_ADD);
      }
    }
  if (!now->material->structure)
    return;
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_TRUE);
  next_pass(GL_ONE, GL_ZERO);
  draw_relief({1, 1, 1, 0.5F}, context);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_FALSE);
  white(GL_ZERO, GL_DST_ALPHA);
  white(GL_DST_COLOR, GL_ONE);
}

/// Pass 1: r = 1/2 f + (1 - 1/2) (1 - f'). (Added as f + (1 - f') - 1/2 the relief would be twice
/// as strong.) Pass 2: the colours, blended as in three passes.
void GlRenderer::State::draw_two(const Context& context) {
  use(0, now->structure, now->material->structure);
  set_env(GL_TEXTURE_ENV_MODE, GL_REPLACE);
  use(1, now->structure, now->material->structure, true);
  constexpr std::array<float, 4> half{0.5F, 0.5F, 0.5F, 1.0F};
  glTexEnvfv(GL_TEXTURE_ENV, GL_TEXTURE_ENV_COLOR, half.data());
  combine(GL_COMBINE_RGB, GL_INTERPOLATE,
          {{GL_PREVIOUS, GL_SRC_COLOR},
           {GL_TEXTURE, GL_ONE_MINUS_SRC_COLOR},
           {GL_CONSTANT, GL_SRC_COLOR}});
  combine(GL_COMBINE_ALPHA, GL_REPLACE, {{GL_PRIMARY_COLOR, GL_SRC_ALPHA}});
  glColor4f(1, 1, 1, 1);
  draw_geometry(context);
  next_pass(GL_DST_COLOR, GL_SRC_COLOR);
  geometry->use_colors(*now->material);
  use_colors(0);
  draw_geometry(context);
}

/// Alpha: f/2, then f/2 + (1 - f'/2) - 1/2 = r; at last the colours times alpha, scaled.
void GlRenderer::State::draw_one(const Context& context) {
  geometry->use_colors(*now->material);
  int unit = 0;
  if (now->joined != 0) {
    use(unit++, now->joined, now->material->structure);
    combine(GL_COMBINE_RGB, GL_MODULATE,
            {{GL_TEXTURE, GL_SRC_COLOR}, {GL_PRIMARY_COLOR, GL_SRC_COLOR}});
    combine(GL_COMBINE_ALPHA, GL_REPLACE, {{GL_TEXTURE, GL_SRC_ALPHA}});
    use(unit++, now->joined, now->material->structure, true);
    combine(GL_COMBINE_RGB, GL_REPLACE, {{GL_PREVIOUS, GL_SRC_COLOR}});
    combine(GL_COMBINE_ALPHA, GL_ADD_SIGNED,
            {{GL_PREVIOUS, GL_SRC_ALPHA}, {GL_TEXTURE, GL_ONE_MINUS_SRC_ALPHA}});
  }
  unit = use_colors(unit);
  if (now->joined != 0) {
    use(unit, now->joined, now->material->structure); // a unit without a texture does nothing
    combine(GL_COMBINE_RGB, GL_MODULATE,
            {{GL_PREVIOUS, GL_SRC_COLOR}, {GL_PREVIOUS, GL_SRC_ALPHA}});
    combine(GL_COMBINE_ALPHA, GL_REPLACE, {{GL_PRIMARY_COLOR, GL_SRC_ALPHA}});
    set_env(GL_RGB_SCALE, static_cast<GLenum>(options.rgb_scale));
  }
  draw_geometry(context);
}

void GlRenderer::State::draw_shader(const Context& context) {
  shaders.at(shader_kind(*now->material)).use(light, *now->material, material.background);
  const auto bind = [&](GlUnit unit, GLuint texture) {
    glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
    glBindTexture(GL_TEXTURE_2D, texture);
  };
  bind(base_unit, now->base);
  bind(detail_unit, now->detail);
  bind(reflection_unit, now->reflection);
  bind(structure_unit, now->structure);
  geometry->use_texcoords(0, offsetof(shading::DrawVertex, st), 2);
  if (light.frames.empty()) {
    geometry->use_texcoords(1, offsetof(shading::DrawVertex, shifted), 2);
    geometry->use_texcoords(2, offsetof(shading::DrawVertex, sphere), 2);
  } else {
    geometry->use_frames();
  }
  units = 3;
  units = 3;
  if (texture::is_at_rest(*now->material)) {
    geometry->use_rests();
    units = light.turns.empty() ? 5 : 7;
  }
  geometry->use_colors(*now->material);
  draw_geometry(context);
  glDisableClientState(GL_NORMAL_ARRAY);
  glUseProgram(0);
}

/// All passes of one group. Where it is seen its first pass leaves a number in the stencil that no
/// other group left there.
void GlRenderer::State::draw_group(const Context& context) {
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDisable(GL_BLEND);
  glDepthFunc(GL_LESS);
  if (groups.size() > 1) {
    if (blended > 255 - max_blended) {
      glClear(GL_STENCIL_BUFFER_BIT);
      blended = 0;
    }
    glEnable(GL_STENCIL_TEST);
    glStencilFunc(GL_ALWAYS, ++blended, 0xff);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  } else {
    glDisable(GL_STENCIL_TEST);
  }
  const int first_pass = blended;
  const bool layered = now->material->detail || now->material->reflection;
  if (options.mode == GlMode::shader)
    draw_shader(context);
  else if (options.mode == GlMode::passes3 && layered)
    draw_three_layered(context);
  else if (options.mode == GlMode::passes1 || !now->material->structure)
    draw_one(context); // without structure one pass does for all
  else if (options.mode == GlMode::passes3)
    draw_three(context);
  else
    draw_two(context);
  if (options.samples > 1 && options.wide && blended > first_pass) {
    glBlendEquation(GL_MIN); // 2 r c, before samples are averaged
    next_pass(GL_ONE, GL_ONE);
    glColor4f(1, 1, 1, 1);
    geometry->draw(now->first, now->count, context);
    glBlendEquation(GL_FUNC_ADD);
  }
}

GlRenderer::GlRenderer(GlContext& gl, const texture::SurfaceMaterial& material, std::uint32_t width,
                       std::uint32_t height, const GlOptions& options)
    : state_(std::make_unique<State>(gl, material, width, height, options)) {
  for (std::size_t g = 0; g <= material.others.size(); ++g)
    if (texture::is_at_rest(texture::material_of_group(material, g)) &&
        options.mode != GlMode::shader)
      throw Error("the fixed functions know neither three projections nor solid textures, expected "
                  "the shader");
  for (std::size_t g = 0; g <= material.others.size(); ++g)
    if (texture::material_of_group(material, g).film.amount > 0 && options.mode != GlMode::shader)
      throw Error("the fixed functions know no wet film, expected the shader");
  state_->load_textures();
  GLint max = 0;
  glGetIntegerv(GL_MAX_TEXTURE_UNITS, &max);
  int wanted = 2;
  for (std::size_t g = 0; g <= material.others.size(); ++g) {
    const texture::SurfaceMaterial& own = texture::material_of_group(material, g);
    if (options.mode == GlMode::passes1 && own.structure)
      wanted = std::max(wanted, 3 + (own.detail ? 1 : 0) + (own.reflection ? 1 : 0));
  }
  if (max < wanted)
    throw Error("this OpenGL has " + std::to_string(max) + " texture units, expected " +
                std::to_string(wanted));
  check_gl();
}
GlRenderer::~GlRenderer() = default;

void GlRenderer::set_drawing(const shading::Drawing& drawing) {
  State& s = *state_;
  if (!drawing.frames.empty() && s.options.mode != GlMode::shader)
    throw Error("the fixed functions have no use for frames, expected offsets at the vertices");
  s.geometry.reset();
  if (drawing.triangles.empty())
    return;
  s.geometry.emplace(drawing, s.material);
  const bool frames = !drawing.frames.empty();
  const bool rotated = !drawing.turns.empty();
  if (frames == s.light.frames.empty() || rotated == s.light.turns.empty())
    s.shaders.clear();
  for (std::size_t g = 0; g < s.groups.size(); ++g) {
    State::Group& group = s.groups[g];
    const bool there = g < shading::group_count(drawing);
    const auto triangles =
        there ? shading::triangles_of_group(drawing, g) : std::span<const Triangle>{};
    group.first = there ? static_cast<std::size_t>(triangles.data() - drawing.triangles.data()) : 0;
    group.count = triangles.size();
    if (group.count == 0)
      continue;
    if (group.material->film.amount > 0 && !frames)
      throw Error("a wet film on a drawing without frames, expected them at each vertex");
    if (texture::is_at_rest(*group.material) && drawing.rests.empty())
      throw Error("textures on the shape at rest for a drawing without it, expected its places");
    if (s.options.mode == GlMode::shader)
      s.shaders.try_emplace(shader_kind(*group.material), *group.material, frames, rotated);
  }
  s.light.frames.resize(frames ? 1 : 0);
  s.light.turns.resize(rotated ? 1 : 0);
  s.light.rest_origin = drawing.rest_origin;
  s.light.rest_scale = drawing.rest_scale;
  set_light(drawing);
  check_gl();
}

void GlRenderer::set_light(const shading::Drawing& drawing) {
  shading::Drawing& light = state_->light;
  light.light = drawing.light;
  light.directional = drawing.directional;
  light.full_distance = drawing.full_distance;
  light.offset = drawing.offset;
  light.camera = drawing.camera;
}

void GlRenderer::draw(const shading::Projection& projection, const Context& context) {
  State& s = *state_;
  s.target.bind();
  glViewport(0, 0, static_cast<GLsizei>(s.width), static_cast<GLsizei>(s.height));
  // The fixed functions clamp each sum, as the composition needs it; blending into floats doesn't.
  glClampColor(GL_CLAMP_READ_COLOR, GL_FALSE);
  glClampColor(GL_CLAMP_FRAGMENT_COLOR, GL_TRUE);
  glClampColor(GL_CLAMP_VERTEX_COLOR, GL_FALSE);
  const std::array<std::uint8_t, 3> background = texture::stored(s.material.background);
  glClearColor(background[0] / 255.0F, background[1] / 255.0F, background[2] / 255.0F, 1);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glClearStencil(0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT | GL_STENCIL_BUFFER_BIT);
  glDisable(GL_CULL_FACE);
  glDisable(GL_DITHER);
  glEnable(GL_DEPTH_TEST);
  s.passes = s.blended = 0;
  if (!s.geometry)
    return;
  set_matrices(projection);
  for (const State::Group& group : s.groups)
    if (group.count > 0) {
      s.now = &group;
      s.draw_group(context);
    }
}

void GlRenderer::finish() {
  glFinish();
}

texture::Image GlRenderer::read(const Context& context) {
  const State& s = *state_;
  s.target.resolve();
  texture::Image image{s.width, s.height, 3, {}};
  image.values.resize(std::size_t{3} * s.width * s.height);
  constexpr std::uint32_t rows_at_once = 16;
  std::vector<std::array<float, 4>> rows(std::size_t{rows_at_once} * s.width);
  for (std::uint32_t from = 0; from < s.height; from += rows_at_once) {
    stop_if_cancelled(context);
    const std::uint32_t count = std::min(rows_at_once, s.height - from);
    glReadPixels(0, static_cast<GLint>(from), static_cast<GLsizei>(s.width),
                 static_cast<GLsizei>(count), GL_RGBA, GL_FLOAT, rows.data());
    for (std::uint32_t row = 0; row < count; ++row) {
      std::uint8_t* out = &image.values[std::size_t{3} * s.width * (s.height - 1 - from - row)];
      for (std::size_t x = 0; x < s.width; ++x)
        for (std::size_t c = 0; c < 3; ++c)
          *out++ = texture::stored(double{rows[std::size_t{row} * s.width + x][c]});
    }
  }
  check_gl();
  return image;
}

const std::string& GlRenderer::target() const {
  return state_->target.format();
}

int GlRenderer::passes() const {
  return state_->passes;
}

double render_gl_bytes(std::uint32_t width, std::uint32_t height, int samples) {
  const double target = samples > 1 ? (16.0 + 4) * samples + 16 : 16.0 + 4;
  return (3.0 + target) * width * height + 16.0 * 16 * width;
}

} // namespace gewebe::gl
