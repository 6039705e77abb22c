#include "texture/color_ramp.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace gewebe {

const std::vector<std::string>& color_ramp_names() {
  static const std::vector<std::string> names{"gray", "heat", "rainbow"};
  return names;
}

ColorRamp color_ramp_from_name(std::string_view name) {
  if (name == "gray")
    return {{{0, 0, 0}, {255, 255, 255}}};
  if (name == "heat")
    return {{{0, 0, 0}, {255, 0, 0}, {255, 255, 0}, {255, 255, 255}}};
  if (name == "rainbow")
    return {{{0, 0, 255}, {0, 255, 255}, {0, 255, 0}, {255, 255, 0}, {255, 0, 0}}};
  throw Error("ramp '" + std::string(name) + "' is unknown, expected gray, heat or rainbow");
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

} // namespace gewebe
