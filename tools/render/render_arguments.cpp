#include "tools/render/render_arguments.h"

#include "texture/color_ramp.h"
#include "tools/render/render_camera.h"
#include "tools/render/render_field.h"
#include "tools/render/render_layer.h"
#include "tools/render/render_legend.h"
#include "tools/render/render_lighting.h"
#include "tools/render/render_materials.h"
#include "tools/render/render_page.h"
#include "tools/render/render_volume.h"

#include <algorithm>
#include <utility>

namespace gewebe::cli {
namespace {

void refuse(bool wrong, const std::string& what) {
  if (wrong)
    throw UsageError(what);
}

std::vector<std::string> words_of(const std::string& list) {
  std::vector<std::string> words;
  for (std::size_t from = 0; from <= list.size();) {
    const std::size_t end = std::min(list.find(',', from), list.size());
    words.push_back(list.substr(from, end - from));
    from = end + 1;
  }
  return words;
}

using Layers = std::array<std::pair<const char*, RenderLayer*>, 4>;

Layers layers_of(RenderArguments& a) {
  return {{{"texture", &a.layers.base},
           {"detail", &a.layers.detail},
           {"reflection", &a.layers.reflection},
           {"structure", &a.layers.structure}}};
}

RenderLayer& layer_of(const Layers& layers, const std::string& option, const std::string& name) {
  for (const auto& [word, layer] : layers)
    if (name == word)
      return *layer;
  throw UsageError(option + ": '" + name +
                   "' is no texture, expected texture, detail, reflection or structure");
}

/// A word for all textures, or a list of TEXTURE=WORD.
template <class Set>
void for_layers(const Layers& layers, const std::string& option, const std::string& list,
                const Set& set) {
  try {
    for (const std::string& part : words_of(list)) {
      const std::size_t mid = part.find('=');
      if (mid != std::string::npos)
        set(layer_of(layers, option, part.substr(0, mid)).options, part.substr(mid + 1));
      else
        for (const auto& [word, layer] : layers)
          set(layer->options, part);
    }
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    throw UsageError(option + ": " + error.what());
  }
}

void complete_textures(RenderArguments& a) {
  const Layers layers = layers_of(a);
  for_layers(layers, "--filter", a.words.filter,
             [](texture::TextureOptions& o, const std::string& w) {
               o.filter = texture::texture_filter_from_name(w);
             });
  for_layers(layers, "--wrap", a.words.wrap, [](texture::TextureOptions& o, const std::string& w) {
    o.wrap = texture::texture_wrap_from_name(w);
  });
  if (a.words.sphere != "none")
    for (const std::string& name : words_of(a.words.sphere))
      layer_of(layers, "--sphere", name).options.sphere = true;
  for (const auto& [word, layer] : layers)
    complete_layer(a, word, *layer);
}

void complete_modes(RenderArguments& a) {
  a.picture.backend = render::backend_from_name(a.words.backend);
  a.picture.gl.mode = gl::gl_mode_from_name(a.words.passes);
  a.picture.gl.wide = a.words.target == "float";
  a.picture.gl.rgb_scale = static_cast<int>(a.words.rgb_scale);
  a.picture.samples = static_cast<int>(a.words.msaa);
  refuse(a.words.msaa != 1 && a.words.msaa != 4,
         "--msaa: expected 1 or 4, not " + std::to_string(a.words.msaa));
  complete_lighting(a);
  if (a.words.tbn != "auto")
    a.picture.per_pixel = a.words.tbn == "pixel";
  refuse(a.words.tbn == "vertex" && a.drawing.rest_light,
         "--tbn vertex for --uv triplanar or a solid structure, expected pixel or auto");
  refuse(a.words.tbn == "pixel" && a.picture.gl.mode != gl::GlMode::shader,
         "--tbn pixel for fixed functions, expected --passes shader");
  constexpr const char* fixed =
      " for --uv triplanar, a solid texture or --wet, expected shader or cpu (--passes shader, "
      "--backend cpu)";
  const bool shaded = a.drawing.rest || a.drawing.wet;
  refuse(shaded && a.picture.backend == render::Backend::gl &&
             a.picture.gl.mode != gl::GlMode::shader && a.view_words.compare.empty(),
         "--passes " + a.words.passes + fixed);
  if (a.view_words.compare.empty())
    return;
  a.film.compare = words_of(a.view_words.compare);
  for (const std::string& mode : a.film.compare)
    refuse(mode != "cpu" &&
               std::ranges::find(gl::gl_mode_names(), mode) == gl::gl_mode_names().end(),
           "--compare: '" + mode + "' is no mode, expected 3, 2, 1, shader or cpu");
  for (const std::string& mode : a.film.compare)
    refuse(shaded && mode != "cpu" && mode != "shader", "--compare: " + mode + fixed);
}

/// What was not said: a picture to show, or the formula alone.
void complete_light(RenderArguments& a) {
  const bool lines = a.look.style == "wireframe", plain = a.words.plain;
  a.drawing.shade = a.view_words.shade.value_or(plain || lines ? 0 : 0.75);
  a.drawing.fill = a.view_words.fill.value_or(plain || a.look.endoscope ? 0 : 0.35);
  a.look.tissue_colors = !a.view_words.color && !plain && !lines;
  const double gray = lines && !plain ? 0.1 : 1;
  a.common.color = a.view_words.color.value_or(Vec3{gray, gray, gray});
  constexpr Vec3 cavity{0.15, 0.05, 0.04};
  a.common.background = a.view_words.background.value_or(plain              ? Vec3{1, 1, 1}
                                                         : a.look.endoscope ? cavity
                                                                            : Vec3{0.8, 0.8, 0.8});
  const bool smooth = plain || a.words.msaa != 1; // by other means, or not at all
  a.picture.supersample = static_cast<std::uint32_t>(a.words.supersample.value_or(smooth ? 1 : 2));
}

void complete_clip(RenderArguments& a) {
  const std::vector<double>& w = a.view_words.clip;
  if (w.empty())
    return;
  a.reading.clip = tetrahedra::ClipPlane{{w[0], w[1], w[2]}, {w[3], w[4], w[5]}};
  refuse(a.reading.clip->normal == Vec3{}, "--clip: expected another normal than 0");
}

void complete(RenderArguments& a) {
  complete_light(a);
  complete_clip(a);
  complete_textures(a);
  complete_materials(a);
  complete_modes(a);
  complete_camera(a);
  complete_volume(a);
  const bool laid_on = a.drawing.texcoords || a.common.rest.triplanar;
  refuse(!laid_on && a.drawing.rest && a.words.uv != "auto",
         "--uv for solid textures alone, which need none, expected no --uv");
  refuse(!laid_on && !a.drawing.rest && (a.words.uv != "auto" || a.mapping.edge),
         "--uv or --uv-scale without texture, expected --texture or --structure");
  refuse(a.words.uv != "auto" && a.words.uv != "box" && !a.drawing.rest && a.mapping.edge,
         "--uv-scale for another mapping, expected --uv box or triplanar");
  refuse(a.words.uv_sharpness && !a.common.rest.triplanar,
         "--uv-sharpness for another mapping, expected --uv triplanar");
  if (a.words.uv_sharpness)
    a.common.rest.sharpness = static_cast<int>(*a.words.uv_sharpness);
  refuse(a.look.offset_texels && has_solid_structure(a),
         "--offset-texels for a solid structure, which has none, expected --offset");
  if (a.words.uv != "auto" && a.words.uv != "triplanar")
    a.mapping.mapping = shading::uv_mapping_from_name(a.words.uv);
  refuse(a.look.light && a.view_words.light_direction,
         "--light and --light-direction, expected one of them");
  if (a.view_words.light_direction) {
    a.look.light = a.view_words.light_direction;
    a.drawing.directional = true;
    refuse(norm(*a.look.light) == 0, "--light-direction: expected another vector than 0");
  }
  complete_field(a);
  complete_legend(a);
  refuse(a.look.no_instruments && a.look.instrument_color,
         "--instrument-color with --no-instruments, expected one of them");
  refuse(!a.film.frames.empty() && a.reading.frame.has_value(),
         "--frame and --frames, expected one of them");
  std::vector<std::string> inputs{a.surface};
  for (const auto& [word, layer] : layers_of(a))
    if (!layer->path.empty())
      inputs.push_back(layer->path);
  for (const std::string& path : material_paths(a))
    inputs.push_back(path);
  if (std::ranges::find(texture::color_ramp_names(), a.volume.ramp) ==
      texture::color_ramp_names().end())
    inputs.push_back(a.volume.ramp);
  check_one_pipe(inputs);
}

void declare_textures(Program& p, RenderArguments& a) {
  const auto path_of = [&a](RenderLayer RenderMaterial::*layer) {
    return [&a, layer](std::int32_t n) -> std::string& { return (a.materials[n].*layer).path; };
  };
  p.option("--texture", a.layers.base.path, "[N=]FILE",
           "colours: PNG, PNM, noise[:key=value,...] or veins[:...]; N=: for material N")
      .numbered(path_of(&RenderMaterial::base));
  p.option("--detail", a.layers.detail.path, "[N=]FILE", "colours that are added")
      .numbered(path_of(&RenderMaterial::detail));
  p.option("--reflection", a.layers.reflection.path, "[N=]FILE",
           "colours that a moist surface mirrors")
      .numbered(path_of(&RenderMaterial::reflection));
  p.option("--structure", a.layers.structure.path, "[N=]FILE",
           "heights to emboss: brightness of an image, noise or veins")
      .numbered(path_of(&RenderMaterial::structure));
  p.option("--by", a.view_words.by, "WORD", "what N counts: material, part, object")
      .one_of(shading::group_by_names());
  p.option("--sphere", a.words.sphere, "LIST",
           "textures seen as in a mirror: texture, detail, reflection, structure, none");
  p.option("--filter", a.words.filter, "WORD", "nearest, linear, mipmap; or TEXTURE=WORD,...");
  p.option("--wrap", a.words.wrap, "WORD", "repeat, clamp, mirror; or TEXTURE=WORD,...");
  p.option("--offset", a.look.offset, "D", "shift of the heights in texture coordinates")
      .range(-1, 1);
  p.option("--offset-texels", a.look.offset_texels, "N", "the same in pixels of the structure");
  p.option("--light", a.look.light, "X,Y,Z",
           "position of the light in mm; default: above the camera, left");
  p.option("--light-direction", a.view_words.light_direction, "X,Y,Z",
           "vector to a light far away");
  p.option("--shade", a.view_words.shade, "K", "share of Lambert's law, 0 to 1 (default 0.75)")
      .range(0, 1);
  p.option("--fill", a.view_words.fill, "F", "strength of the second light, 0 to 1 (default 0.35)")
      .range(0, 1);
  p.flag("--plain", a.words.plain, "relief alone: no shade, white on white, one sample per pixel");
  p.option("--color", a.view_words.color, "[N=]R,G,B",
           "colour, 0 to 1 each; default: that of the material, 1,1,1 with an image")
      .range(0, 1)
      .numbered([&a](std::int32_t n) -> std::optional<Vec3>& { return a.materials[n].color; });
  p.option("--background", a.view_words.background, "R,G,B", "0 to 1 (default 0.8,0.8,0.8)")
      .range(0, 1);
  p.option("--uv", a.words.uv, "MAP",
           "auto (the mesh's coordinates, else box), box, sphere, cylinder, triplanar")
      .one_of({"auto", "box", "sphere", "cylinder", "triplanar"});
  p.option("--uv-scale", a.mapping.edge, "MM",
           "edge of the texture for box and triplanar; default: half the mesh")
      .positive();
  p.option("--uv-sharpness", a.words.uv_sharpness, "P",
           "power that blends triplanar projections; default: 4")
      .range(1, 64);
}

} // namespace

void declare(Program& p, RenderArguments& a) {
  declare_textures(p, a);
  declare_lighting(p, a);
  p.option("--style", a.look.style, "STYLE", "textured, flat (facets), wireframe")
      .one_of({"textured", "flat", "wireframe"});
  p.option("--crease", a.look.crease, "DEG", "edges that turn by more than this are sharp")
      .range(0, 180);
  declare_camera(p, a);
  p.option("--backend", a.words.backend, "NAME", "gl, cpu; auto: gl on a graphics card")
      .one_of(render::backend_names());
  p.option("--passes", a.words.passes, "N", "algorithm of OpenGL: 3, 2, 1 or shader")
      .one_of(gl::gl_mode_names());
  p.option("--gl-target", a.words.target, "KIND", "precision of OpenGL's colours: float, 8bit")
      .one_of({"float", "8bit"});
  p.option("--rgb-scale", a.words.rgb_scale, "S",
           "factor of colours with --passes 1: 2, or 1 (darker)")
      .range(1, 2);
  p.option("--tbn", a.words.tbn, "WHERE", "where the light is transformed: vertex, pixel, auto")
      .one_of({"auto", "vertex", "pixel"});
  p.option("--compare", a.view_words.compare, "MODES",
           "modes side by side, such as 3,2,1,shader,cpu");
  p.option("--clip", a.view_words.clip, "X,Y,Z,NX,NY,NZ",
           "cut solids open by a plane; remove the side that the direction points to")
      .count(6);
  p.option("--object", a.reading.object, "NAME", "draw this object of a result alone");
  p.flag("--no-instruments", a.look.no_instruments, "draw no instruments of a result");
  p.option("--instrument-color", a.look.instrument_color, "R,G,B",
           "colour of instruments, 0 to 1 each (default 0.75,0.77,0.8)")
      .range(0, 1);
  p.option("--frame", a.reading.frame, "K",
           "frame of a result from 0; -1, the default, is the last")
      .range(-1, 1e15);
  p.option("--frames", a.film.frames, "A:B:STEP", "a picture of each of these frames, or all");
  p.option("--fps", a.film.rate, "N", "pictures per second of a film (default 25)")
      .range(0.1, 1000);
  p.option("--turn", a.film.turn, "N", "the camera goes around once in N pictures")
      .range(1, 100000);
  p.option("--turn-light", a.film.turn_light, "N", "the light goes around once in N pictures")
      .range(1, 100000);
  p.option("--unit", a.reading.unit, "UNIT", "unit of the mesh: m, cm, mm")
      .one_of(surface_unit_names());
  declare_field(p, a);
  declare_legend(p, a);
  declare_volume(p, a);
  p.check([&p, &a] {
    note_look_options(p, a);
    complete(a);
  });
}

} // namespace gewebe::cli
