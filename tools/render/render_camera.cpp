#include "tools/render/render_camera.h"

#include "shading/endoscope.h"

#include <cmath>
#include <tuple>

namespace gewebe::cli {
namespace {

void refuse(bool wrong, const std::string& what) {
  if (wrong)
    throw UsageError(what);
}

} // namespace

void declare_camera(Program& p, RenderArguments& a) {
  p.option("--view", a.view_words.view, "SIDE",
           "front (if no --eye), back, left, right, top, bottom, iso")
      .one_of(shading::view_names());
  p.option("--orbit", a.view_words.orbit, "AZ,EL", "degrees to walk around to the right, and up")
      .count(2);
  p.option("--distance", a.camera.distance, "MM", "distance of the camera; default: all is visible")
      .positive();
  p.option("--eye", a.camera.eye, "X,Y,Z", "position of the camera in mm");
  p.option("--target", a.camera.target, "X,Y,Z",
           "point in the middle of the picture; default: middle at rest");
  p.option("--up", a.camera.up, "X,Y,Z", "direction up; default: z (top and bottom: y)");
  p.option("--fov", a.view_words.fov, "DEG",
           "angle across the shorter side, with --endoscope 70 (default 30)")
      .range(1, 170);
  p.option("--size", a.words.size, "WxH", "pixels of the picture, N for a square");
  p.option("--supersample", a.words.supersample, "N",
           "a pixel is the mean of N x N samples (default 2; volumes, --msaa: 1)")
      .range(1, 8);
  p.option("--msaa", a.words.msaa, "N", "1, or 4 samples along outlines").range(1, 4);
}

void complete_camera(RenderArguments& a) {
  refuse(a.camera.eye && (!a.view_words.view.empty() || a.camera.distance),
         "--eye with --view or --distance, expected one way to place the camera");
  if (!a.view_words.view.empty())
    a.camera.view = a.view_words.view;
  a.camera.fov =
      a.view_words.fov.value_or(a.look.endoscope ? shading::endoscope_fov : a.camera.fov);
  a.camera.azimuth = a.view_words.orbit[0];
  a.camera.elevation = a.view_words.orbit[1];
  refuse(!(std::abs(a.camera.azimuth) <= 3600 && std::abs(a.camera.elevation) <= 90),
         "--orbit: expected an azimuth up to 3600 and an elevation from -90 to 90 degrees");
  try {
    std::tie(a.picture.width, a.picture.height) = render::picture_size_from_text(a.words.size);
  } catch (const Error& error) {
    throw UsageError(std::string("--size: ") + error.what());
  }
}

} // namespace gewebe::cli
