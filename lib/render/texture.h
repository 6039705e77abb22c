#pragma once
// Textures as both backends read them: bilinear, repeated in both directions.

#include "render/image.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace gewebe {

/// Texel (0, 0) is the lower left one, its centre at s = 1/2 width, t = 1/2 height: an image's
/// lower left corner has the coordinates (0, 0), its upper right one (1, 1).
struct Texture {
  std::uint32_t width = 0, height = 0;
  std::uint32_t channels = 3;       ///< 1 or 3
  std::vector<std::uint8_t> values; ///< rows from the bottom
};

/// \throw Error if the image has no pixel
Texture texture_from(const Image& image);

/// The value at (s, t), bilinear between texel centres, 0 … 1; a gray texture gives three equal
/// values. \pre s and t are finite
inline std::array<double, 3> sample(const Texture& texture, double s, double t) {
  // The two neighbours along one axis and the weight of the second.
  const auto neighbours = [](double x, std::uint32_t count, std::size_t& a, std::size_t& b) {
    const double at = (x - std::floor(x)) * count - 0.5;
    const double below = std::floor(at); // -1 … count - 1, count if x - floor(x) rounds to 1
    a = below < 0 ? count - 1 : static_cast<std::size_t>(below) % count;
    b = a + 1 == count ? 0 : a + 1;
    return at - below;
  };
  std::size_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  const double fx = neighbours(s, texture.width, x0, x1);
  const double fy = neighbours(t, texture.height, y0, y1);
  const std::size_t n = texture.channels, row = n * texture.width;
  const std::uint8_t *const p00 = &texture.values[y0 * row + x0 * n],
                            *const p10 = &texture.values[y0 * row + x1 * n],
                            *const p01 = &texture.values[y1 * row + x0 * n],
                            *const p11 = &texture.values[y1 * row + x1 * n];
  std::array<double, 3> value{};
  for (std::size_t c = 0; c < n; ++c) {
    const double low = p00[c] + fx * (static_cast<double>(p10[c]) - p00[c]);
    const double high = p01[c] + fx * (static_cast<double>(p11[c]) - p01[c]);
    value[c] = (low + fy * (high - low)) * (1.0 / 255);
  }
  if (n == 1)
    value[1] = value[2] = value[0];
  return value;
}

} // namespace gewebe
