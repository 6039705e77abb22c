#pragma once
// Colours for values.

#include "texture/image.h"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::texture {

/// Colours at equal distances from the least value to the greatest, linear between them.
struct ColorRamp {
  std::vector<std::array<std::uint8_t, 3>> colors; ///< one at least
};

/// "viridis" and "cividis" (equal steps look equal, also to colour-blind people; cividis to all
/// alike), "gray" (black to white), "heat" (black, red, yellow, white), "rainbow" (blue, cyan,
/// green, yellow, red).
const std::vector<std::string>& color_ramp_names();
/// \throw Error if there is no such ramp
ColorRamp color_ramp_from_name(std::string_view name);
/// The pixels of the middle row, from left to right. \throw Error if the image has none
ColorRamp color_ramp_from_image(const Image& image);

/// At a share of its length, 0 … 1 (beyond it that of its ends), 0 … 255.
std::array<double, 3> ramp_color(const ColorRamp& ramp, double share);

/// The colour of each value: the ramp's first one up to `min`, its last one from `max` on.
/// \pre min < max, values.size() == width · height
Image colored(std::span<const float> values, std::uint32_t width, std::uint32_t height, double min,
              double max, const ColorRamp& ramp);

} // namespace gewebe::texture
