#include "tools/render/render_lighting.h"

#include <algorithm>
#include <utility>

namespace gewebe::cli {
namespace {

void refuse(bool wrong, const std::string& what) {
  if (wrong)
    throw UsageError(what);
}

bool is_wet(const RenderArguments& a) {
  return a.look.wet.value_or(0) > 0 || std::ranges::any_of(a.materials, [](const auto& material) {
           return material.second.wet.value_or(0) > 0;
         });
}

} // namespace

void declare_lighting(Program& p, RenderArguments& a) {
  p.option("--wet", a.look.wet, "[N=]W", "film of water that mirrors light and background, 0 to 1")
      .range(0, 1)
      .numbered([&a](std::int32_t n) -> std::optional<double>& { return a.materials[n].wet; });
  p.option("--wet-roughness", a.look.wet_roughness, "[N=]R",
           "roughness of the film, 0.1 to 1 (default 0.3)")
      .range(0.1, 1)
      .numbered(
          [&a](std::int32_t n) -> std::optional<double>& { return a.materials[n].wet_roughness; });
  p.option("--occlusion", a.drawing.occlusion, "O", "darken points hidden by near surfaces, 0 to 1")
      .range(0, 1);
  p.option("--occlusion-radius", a.look.occlusion_radius, "MM",
           "distance up to which surfaces hide; default: a quarter of the longest side")
      .positive();
  p.option("--inside", a.look.inside, "R,G,B",
           "colour of surfaces seen from within; default: as outside")
      .range(0, 1);
  p.flag("--endoscope", a.look.endoscope, "light at the camera, round field, wide angle");
  p.option("--reach", a.look.reach, "MM",
           "distance up to which an endoscope's light is full; default: the target")
      .positive();
}

void complete_lighting(RenderArguments& a) {
  a.drawing.wet = is_wet(a);
  const bool rough =
      a.look.wet_roughness || std::ranges::any_of(a.materials, [](const auto& material) {
        return material.second.wet_roughness.has_value();
      });
  refuse(rough && !a.drawing.wet, "--wet-roughness without a film, expected --wet above 0");
  refuse(a.drawing.wet && (a.words.plain || a.look.style == "wireframe"),
         "--wet with --plain or --style wireframe, which have no light on them, expected one of "
         "them");
  refuse(a.look.occlusion_radius && !(a.drawing.occlusion > 0),
         "--occlusion-radius without --occlusion, expected both");
  refuse(a.drawing.occlusion > 0 && a.look.style == "wireframe",
         "--occlusion with --style wireframe, which has no surfaces, expected one of them");
  refuse(
      a.look.crease && a.look.style != "textured",
      "--crease with --style flat or wireframe, which have no round edges, expected one of them");
  refuse(a.look.inside && a.look.style == "wireframe",
         "--inside with --style wireframe, which has no surfaces, expected one of them");
  a.drawing.insides = a.look.inside.has_value();
  refuse(a.look.reach && !a.look.endoscope, "--reach without --endoscope, expected both");
  refuse(a.look.endoscope && (a.look.light || a.view_words.light_direction || a.film.turn_light),
         "--endoscope with another light, expected no --light, --light-direction or --turn-light");
  refuse(a.look.endoscope && (a.words.plain || a.look.style == "wireframe"),
         "--endoscope with --plain or --style wireframe, which have no light on them, expected one "
         "of them");
  refuse(a.drawing.wet && a.words.tbn == "vertex",
         "--tbn vertex for --wet, expected pixel or auto");
}

void add_inside_material(texture::SurfaceMaterial& common, const RenderArguments& a) {
  if (!a.look.inside)
    return;
  texture::SurfaceMaterial own;
  own.color = *a.look.inside;
  own.background = common.background;
  own.film = film_of(a, nullptr);
  common.others.push_back(std::move(own));
}

texture::WetFilm film_of(const RenderArguments& a, const RenderMaterial* own) {
  texture::WetFilm film;
  film.amount = a.look.wet.value_or(0);
  film.roughness = a.look.wet_roughness.value_or(film.roughness);
  if (own != nullptr) {
    film.amount = own->wet.value_or(film.amount);
    film.roughness = own->wet_roughness.value_or(film.roughness);
  }
  return film;
}

} // namespace gewebe::cli
