#pragma once
// What a picture shows, in its corners: colours of values, a length, the time.

#include "geometry/vec3.h"
#include "texture/color_ramp.h"
#include "texture/image.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace gewebe::texture {

/// Pictures whose shorter side has fewer pixels have no room for a legend.
constexpr std::uint32_t least_legend_side = 200;

struct LegendBar {
  std::string title;           ///< with unit
  std::array<double, 2> range; ///< values of the first and last colour
  ColorRamp ramp;
};

struct Legend {
  std::optional<LegendBar> bar;
  std::optional<double> mm_per_pixel; ///< at the depth of the target
  std::optional<double> time;         ///< s

  bool empty() const { return !bar && !mm_per_pixel && !time; }
};

/// Draws bar (right), scale (below, left) and time (above, left), in black or white by the
/// background (0 … 1). \pre sides from least_legend_side, 3 channels
void draw_legend(Image& picture, const Legend& legend, const Vec3& background);

} // namespace gewebe::texture
