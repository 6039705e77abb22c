#pragma once
// emboss-render --legend: which legend pictures get.

#include "formats/stream/stream.h"
#include "shading/camera.h"
#include "texture/legend.h"
#include "tools/cli/cli.h"
#include "tools/render/render_arguments.h"

#include <cstdint>

namespace gewebe::cli {

void declare_legend(Program& program, RenderArguments& arguments);
/// Turns the word into whether there is one. \pre complete_field and complete_camera are done
/// \throw UsageError where there is no room
void complete_legend(RenderArguments& arguments);

/// Legends of surfaces, picture by picture.
class SurfaceLegends {
public:
  /// Reads the times of a result. \pre take_field is done \throw Error with place
  SurfaceLegends(const RenderArguments& arguments, const formats::Input& input);
  /// Draws that of a picture of a frame (-1: the last). \return whether it is that before it
  bool draw(texture::Image& picture, const shading::Camera& camera, std::int64_t frame);

private:
  const RenderArguments& arguments_;
  std::vector<double> times_; ///< of a result
  texture::Legend last_;
};

/// Legend of a volume's picture. \param mm_per_pixel as in Legend
void draw_volume_legend(texture::Image& picture, const RenderArguments& arguments,
                        const texture::ColorRamp& ramp, const std::array<double, 2>& range,
                        double mm_per_pixel);

} // namespace gewebe::cli
