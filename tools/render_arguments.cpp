#include "tools/render_arguments.h"

#include <tuple>
#include <vector>

namespace gewebe::cli {
namespace {

void refuse(bool wrong, const char* what) {
  if (wrong)
    throw UsageError(what);
}

void complete(RenderArguments& a) {
  const bool textured = !a.base.empty() || !a.structure.empty();
  refuse(a.camera.eye && (!a.view.empty() || a.camera.distance),
         "--eye with --view or --distance, expected one way to place the camera");
  refuse(!textured && (a.uv != "auto" || a.mapping.edge),
         "--uv or --uv-scale without texture, expected --texture or --structure");
  refuse(a.uv != "auto" && a.uv != "box" && a.mapping.edge,
         "--uv-scale for another mapping, expected --uv box");
  std::vector<std::string> inputs{a.surface};
  for (const std::string& texture : {a.base, a.structure})
    if (!texture.empty())
      inputs.push_back(texture);
  check_one_pipe(inputs);
  try {
    std::tie(a.picture.width, a.picture.height) = picture_size_from_text(a.size);
  } catch (const Error& error) {
    throw UsageError(std::string("--size: ") + error.what());
  }
  a.picture.supersample = static_cast<std::uint32_t>(a.supersample);
  a.picture.backend = backend_from_name(a.backend);
  if (!a.view.empty())
    a.camera.view = a.view;
  a.drawing.texcoords = textured;
  a.drawing.structure = !a.structure.empty();
  if (a.uv != "auto")
    a.mapping.mapping = uv_mapping_from_name(a.uv);
}

} // namespace

void declare(Program& p, RenderArguments& a) {
  p.option("--texture", a.base, "FILE", "colours: PNG or PNM");
  p.option("--structure", a.structure, "FILE", "heights to emboss: brightness of a PNG or PNM");
  p.option("--offset", a.drawing.offset, "D", "shift of the heights in texture coordinates")
      .range(-1, 1);
  p.option("--light", a.light, "X,Y,Z", "place of the light in mm, else above the camera, left");
  p.option("--shade", a.drawing.shade, "K", "share of Lambert's law, 0 to 1").range(0, 1);
  p.option("--color", a.look.color, "R,G,B", "factor of the colours, 0 to 1").range(0, 1);
  p.option("--background", a.look.background, "R,G,B", "0 to 1").range(0, 1);
  p.option("--uv", a.uv, "MAP", "auto (the mesh's coordinates, else box), box, sphere, cylinder")
      .one_of({"auto", "box", "sphere", "cylinder"});
  p.option("--uv-scale", a.mapping.edge, "MM", "edge of the texture for box, else half the mesh")
      .positive();
  p.option("--view", a.view, "SIDE", "front (if no --eye), back, left, right, top, bottom, iso")
      .one_of(view_names());
  p.option("--distance", a.camera.distance, "MM", "of the eye, else so that all is seen")
      .positive();
  p.option("--eye", a.camera.eye, "X,Y,Z", "place of the camera in mm");
  p.option("--target", a.camera.target, "X,Y,Z", "where it looks, else the middle at rest");
  p.option("--up", a.camera.up, "X,Y,Z", "up in the picture, else z (top and bottom: y)");
  p.option("--fov", a.camera.fov, "DEG", "angle across the shorter side").range(1, 170);
  p.option("--size", a.size, "WxH", "pixels of the picture, N for a square");
  p.option("--supersample", a.supersample, "N", "a pixel is the mean of N x N samples").range(1, 8);
  p.option("--backend", a.backend, "NAME", "gl, cpu; auto: gl or else cpu").one_of(backend_names());
  p.option("--passes", a.passes, "N", "OpenGL passes with a structure").one_of({"2"});
  p.option("--object", a.reading.object, "NAME", "of a result: this object, else all");
  p.option("--frame", a.reading.frame, "K", "of a result, from 0; -1 is the last, the default")
      .range(-1, 1e15);
  p.option("--unit", a.reading.unit, "UNIT", "of the mesh: m, cm, mm").one_of(surface_unit_names());
  p.check([&a] { complete(a); });
}

} // namespace gewebe::cli
