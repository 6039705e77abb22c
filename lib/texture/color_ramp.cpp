#include "texture/color_ramp.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace gewebe::texture {

namespace {

// Every fifth of 256 colours, from _cm_listed.py of matplotlib 3, which is under CC0.
// Viridis: S. van der Walt, N. Smith, E. Firing, 2015. Cividis: J. Nunez, C. Anderton, R. Renslow,
// Optimizing colormaps with consideration for color vision deficiency, PLoS ONE 13(7), 2018.
constexpr std::array<std::array<std::uint8_t, 3>, 52> viridis{
    {{{68, 1, 84}},    {{70, 8, 92}},    {{71, 16, 99}},   {{72, 23, 105}},  {{72, 29, 111}},
     {{72, 36, 117}},  {{71, 42, 122}},  {{70, 48, 126}},  {{69, 55, 129}},  {{67, 61, 132}},
     {{65, 66, 135}},  {{63, 72, 137}},  {{61, 78, 138}},  {{58, 83, 139}},  {{56, 89, 140}},
     {{53, 94, 141}},  {{51, 99, 141}},  {{49, 104, 142}}, {{46, 109, 142}}, {{44, 113, 142}},
     {{42, 118, 142}}, {{41, 123, 142}}, {{39, 128, 142}}, {{37, 132, 142}}, {{35, 137, 142}},
     {{33, 142, 141}}, {{32, 146, 140}}, {{31, 151, 139}}, {{30, 156, 137}}, {{31, 161, 136}},
     {{33, 165, 133}}, {{36, 170, 131}}, {{40, 174, 128}}, {{46, 179, 124}}, {{53, 183, 121}},
     {{61, 188, 116}}, {{70, 192, 111}}, {{80, 196, 106}}, {{90, 200, 100}}, {{101, 203, 94}},
     {{112, 207, 87}}, {{124, 210, 80}}, {{137, 213, 72}}, {{149, 216, 64}}, {{162, 218, 55}},
     {{176, 221, 47}}, {{189, 223, 38}}, {{202, 225, 31}}, {{216, 226, 25}}, {{229, 228, 25}},
     {{241, 229, 29}}, {{253, 231, 37}}}};
constexpr std::array<std::array<std::uint8_t, 3>, 52> cividis{
    {{{0, 34, 78}},     {{0, 38, 86}},     {{0, 42, 95}},     {{0, 45, 104}},    {{0, 48, 112}},
     {{8, 51, 112}},    {{22, 55, 112}},   {{32, 58, 111}},   {{39, 62, 110}},   {{46, 65, 109}},
     {{52, 69, 108}},   {{58, 72, 108}},   {{63, 76, 108}},   {{68, 79, 108}},   {{73, 83, 108}},
     {{78, 86, 108}},   {{83, 90, 109}},   {{87, 93, 109}},   {{92, 97, 110}},   {{96, 100, 111}},
     {{101, 104, 112}}, {{105, 107, 113}}, {{109, 111, 114}}, {{114, 114, 116}}, {{118, 118, 118}},
     {{122, 122, 120}}, {{126, 125, 120}}, {{131, 129, 121}}, {{136, 133, 120}}, {{141, 136, 120}},
     {{146, 140, 120}}, {{150, 144, 119}}, {{155, 148, 118}}, {{160, 152, 117}}, {{165, 156, 116}},
     {{170, 160, 115}}, {{175, 164, 113}}, {{181, 168, 111}}, {{186, 172, 109}}, {{191, 176, 107}},
     {{196, 180, 104}}, {{201, 185, 101}}, {{207, 189, 98}},  {{212, 193, 95}},  {{218, 198, 91}},
     {{223, 202, 87}},  {{229, 207, 82}},  {{234, 211, 76}},  {{240, 216, 70}},  {{246, 221, 63}},
     {{252, 226, 54}},  {{254, 232, 56}}}};

} // namespace

const std::vector<std::string>& color_ramp_names() {
  static const std::vector<std::string> names{"viridis", "cividis", "gray", "heat", "rainbow"};
  return names;
}

ColorRamp color_ramp_from_name(std::string_view name) {
  if (name == "viridis")
    return {{viridis.begin(), viridis.end()}};
  if (name == "cividis")
    return {{cividis.begin(), cividis.end()}};
  if (name == "gray")
    return {{{0, 0, 0}, {255, 255, 255}}};
  if (name == "heat")
    return {{{0, 0, 0}, {255, 0, 0}, {255, 255, 0}, {255, 255, 255}}};
  if (name == "rainbow")
    return {{{0, 0, 255}, {0, 255, 255}, {0, 255, 0}, {255, 255, 0}, {255, 0, 0}}};
  throw Error("ramp '" + std::string(name) +
              "' is unknown, expected viridis, cividis, gray, heat or rainbow");
}

ColorRamp color_ramp_from_image(const Image& image) {
  if (image.width == 0 || image.height == 0)
    throw Error("the ramp has no pixel, expected one at least");
  ColorRamp ramp;
  const std::size_t row = std::size_t{image.height / 2} * image.width;
  for (std::size_t x = 0; x < image.width; ++x) {
    const std::size_t at = (row + x) * image.channels, step = image.channels == 3 ? 1 : 0;
    ramp.colors.push_back({image.values[at], image.values[at + step], image.values[at + 2 * step]});
  }
  return ramp;
}

std::array<double, 3> ramp_color(const ColorRamp& ramp, double share) {
  const std::size_t last = ramp.colors.size() - 1;
  const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(last);
  const std::size_t n = std::min(static_cast<std::size_t>(place), last);
  const auto &a = ramp.colors[n], &b = ramp.colors[std::min(n + 1, last)];
  std::array<double, 3> color{};
  for (std::size_t k = 0; k < 3; ++k)
    color[k] = a[k] + (b[k] - a[k]) * (place - static_cast<double>(n));
  return color;
}

Image colored(std::span<const float> values, std::uint32_t width, std::uint32_t height, double min,
              double max, const ColorRamp& ramp) {
  Image image{width, height, 3, {}};
  image.values.reserve(values.size() * 3);
  for (const float value : values)
    for (const double mixed : ramp_color(ramp, (static_cast<double>(value) - min) / (max - min)))
      image.values.push_back(static_cast<std::uint8_t>(std::floor(mixed + 0.5)));
  return image;
}

} // namespace gewebe::texture
