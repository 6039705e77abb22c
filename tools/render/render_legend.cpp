#include "tools/render/render_legend.h"

#include "base/error.h"
#include "formats/results/results.h"
#include "geometry/vec3.h"
#include "tools/render/render_volume.h"

#include <algorithm>

namespace gewebe::cli {

void declare_legend(Program& p, RenderArguments& a) {
  p.option("--legend", a.words.legend, "WHEN",
           "colours and range, length in mm, time: on, off; auto: with --field, from 200 pixels")
      .one_of({"auto", "on", "off"});
}

void complete_legend(RenderArguments& a) {
  const bool room = std::min(a.picture.width, a.picture.height) >= least_legend_side;
  const bool asked = a.words.legend == "on";
  if (asked && !room)
    throw UsageError("--legend for a picture of less than " + std::to_string(least_legend_side) +
                     " pixels, expected a larger --size");
  if (asked && !a.compare.empty())
    throw UsageError(
        "--legend with --compare, which has pictures side by side, expected one of them");
  a.legend =
      asked || (a.words.legend == "auto" && room && !a.reading.field.empty() && a.compare.empty());
}

SurfaceLegends::SurfaceLegends(const RenderArguments& a, const Input& input) : arguments_(a) {
  if (!a.legend)
    return;
  if (a.reading.kind == Kind::hdf5)
    times_ = read_result_index(input.name()).times;
  if (!a.reading.field.empty() && a.reading.field_range)
    last_.bar = LegendBar{a.reading.field + (a.reading.field == "displacement" ? " [mm]" : " [Pa]"),
                          *a.reading.field_range, a.ramp};
}

bool SurfaceLegends::draw(Image& picture, const Camera& camera, std::int64_t frame) {
  if (!arguments_.legend)
    return true;
  const Legend before = last_;
  last_.mm_per_pixel = 2 * camera.tan_x * dot(camera.eye - camera.target, camera.back) /
                       static_cast<double>(picture.width);
  if (!(*last_.mm_per_pixel > 0)) // the target is behind the camera
    last_.mm_per_pixel.reset();
  if (!times_.empty())
    last_.time = frame < 0 ? times_.back() : times_.at(static_cast<std::size_t>(frame));
  draw_legend(picture, last_, arguments_.common.background);
  return last_.time == before.time && last_.mm_per_pixel == before.mm_per_pixel;
}

void draw_volume_legend(Image& picture, const RenderArguments& a, const ColorRamp& ramp,
                        const std::array<double, 2>& range, double mm_per_pixel) {
  if (!a.legend)
    return;
  Legend legend;
  legend.bar = LegendBar{"value", range, ramp};
  legend.mm_per_pixel = mm_per_pixel;
  draw_legend(picture, legend, a.words.background.value_or(Vec3{}));
}

} // namespace gewebe::cli
