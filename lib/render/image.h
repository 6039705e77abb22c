#pragma once
// Pictures and textures as they stand in files: 8 bits a value, rows from the top.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace gewebe {

struct Image {
  std::uint32_t width = 0, height = 0;
  std::uint32_t channels = 3;       ///< 1 (gray) or 3 (red, green, blue)
  std::vector<std::uint8_t> values; ///< width · height · channels, pixel by pixel

  bool operator==(const Image&) const = default;
};

/// The brightness of each pixel, one channel: Rec. 709 weights on the stored values; the image
/// itself if it is gray.
Image luminance(const Image& image);

/// Each pixel the mean of factor × factor pixels, rounded. \pre both sides are multiples of factor,
/// which is 1 to 256
Image shrunk(const Image& image, std::uint32_t factor);

/// XXH3-64 of the values, 16 hexadecimal digits.
std::string image_digest(const Image& image);

} // namespace gewebe
