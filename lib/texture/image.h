#pragma once
// Pictures and textures as they stand in files: rows from the top.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace gewebe::texture {

template <class Value>
struct Pixels {
  std::uint32_t width = 0, height = 0;
  std::uint32_t channels = 3; ///< 1 (gray) or 3 (red, green, blue)
  std::vector<Value> values;  ///< width · height · channels, pixel by pixel

  bool operator==(const Pixels&) const = default;
};
using Image = Pixels<std::uint8_t>;      ///< 0 … 255
using DeepImage = Pixels<std::uint16_t>; ///< 0 … 65535

/// A height, or a brightness, for each pixel in 16 bits, rows from the top.
struct Heights {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint16_t> values; ///< width · height

  bool operator==(const Heights&) const = default;
};

/// The brightness of each pixel, one channel: Rec. 709 weights on the stored values; the image
/// itself if it is gray.
Image luminance(const Image& image);

/// The same in 16 bits, colours not rounded to 8 in between.
Heights heights_from(const DeepImage& image);

/// Each pixel the mean of factor × factor pixels, rounded. \pre both sides are multiples of factor,
/// which is 1 to 256
Image shrunk(const Image& image, std::uint32_t factor);

/// The images side by side, from left to right. \pre of equal height and channels, one at least
Image side_by_side(const std::vector<Image>& images);

/// XXH3-64 of the values, 16 hexadecimal digits.
std::string image_digest(const Image& image);

} // namespace gewebe::texture
