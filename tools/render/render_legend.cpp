#include "tools/render/render_legend.h"

#include "base/error.h"
#include "formats/results/results.h"
#include "geometry/vec3.h"
#include "tools/render/render_volume.h"

#include <algorithm>

namespace gewebe::cli {

void declare_legend(Program& p, RenderArguments& a) {
  p.option("--legend", a.view_words.legend, "WHEN",
           "colours and range, length in mm, time: on, off; auto: with --field, from 200 pixels")
      .one_of({"auto", "on", "off"});
}

void complete_legend(RenderArguments& a) {
  const bool room = std::min(a.picture.width, a.picture.height) >= texture::least_legend_side;
  const bool asked = a.view_words.legend == "on";
  if (asked && !room)
    throw UsageError("--legend for a picture of less than " +
                     std::to_string(texture::least_legend_side) +
                     " pixels, expected a larger --size");
  if (asked && !a.film.compare.empty())
    throw UsageError(
        "--legend with --compare, which has pictures side by side, expected one of them");
  a.legend = asked || (a.view_words.legend == "auto" && room && !a.reading.field.empty() &&
                       a.film.compare.empty());
}

SurfaceLegends::SurfaceLegends(const RenderArguments& a, const formats::Input& input)
    : arguments_(a) {
  if (!a.legend)
    return;
  if (a.reading.kind == formats::Kind::hdf5)
    times_ = formats::read_result_index(input.name()).times;
  if (!a.reading.field.empty() && a.reading.field_range)
    last_.bar = texture::LegendBar{a.reading.field +
                                       (a.reading.field == "displacement" ? " [mm]" : " [Pa]"),
                                   *a.reading.field_range, a.ramp};
}

bool SurfaceLegends::draw(texture::Image& picture, const shading::Camera& camera,
                          std::int64_t frame) {
  if (!arguments_.legend)
    return true;
  const texture::Legend before = last_;
  last_.mm_per_pixel = 2 * camera.tan_x * dot(camera.eye - camera.target, camera.back) /
                       static_cast<double>(picture.width);
  if (!(*last_.mm_per_pixel > 0)) // the target is behind the camera
    last_.mm_per_pixel.reset();
  if (!times_.empty())
    last_.time = frame < 0 ? times_.back() : times_.at(static_cast<std::size_t>(frame));
  texture::draw_legend(picture, last_, arguments_.common.background);
  return last_.time == before.time && last_.mm_per_pixel == before.mm_per_pixel;
}

void draw_volume_legend(texture::Image& picture, const RenderArguments& a,
                        const texture::ColorRamp& ramp, const std::array<double, 2>& range,
                        double mm_per_pixel) {
  if (!a.legend)
    return;
  texture::Legend legend;
  legend.bar = texture::LegendBar{"value", range, ramp};
  legend.mm_per_pixel = mm_per_pixel;
  texture::draw_legend(picture, legend, a.view_words.background.value_or(Vec3{}));
}

} // namespace gewebe::cli
