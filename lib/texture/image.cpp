#include "texture/image.h"

#include "base/digest.h"

namespace gewebe::texture {

Image luminance(const Image& image) {
  if (image.channels == 1)
    return image;
  Image gray{image.width, image.height, 1, {}};
  gray.values.reserve(image.values.size() / 3);
  for (std::size_t at = 0; at + 2 < image.values.size(); at += 3) {
    const unsigned sum = 2126U * image.values[at] + 7152U * image.values[at + 1] +
                         722U * image.values[at + 2] + 5000U;
    gray.values.push_back(static_cast<std::uint8_t>(sum / 10000U));
  }
  return gray;
}

Heights heights_from(const DeepImage& image) {
  Heights heights{image.width, image.height, {}};
  if (image.channels == 1) {
    heights.values = image.values;
    return heights;
  }
  heights.values.reserve(image.values.size() / 3);
  for (std::size_t at = 0; at + 2 < image.values.size(); at += 3) {
    const std::uint32_t sum = 2126U * image.values[at] + 7152U * image.values[at + 1] +
                              722U * image.values[at + 2] + 5000U; // below 2^30
    heights.values.push_back(static_cast<std::uint16_t>(sum / 10000U));
  }
  return heights;
}

Image shrunk(const Image& image, std::uint32_t factor) {
  if (factor == 1)
    return image;
  Image small{image.width / factor, image.height / factor, image.channels, {}};
  const std::size_t row = std::size_t{image.width} * image.channels;
  const std::uint32_t count = factor * factor;
  small.values.reserve(std::size_t{small.width} * small.height * small.channels);
  for (std::size_t y = 0; y < small.height; ++y)
    for (std::size_t x = 0; x < small.width; ++x)
      for (std::size_t c = 0; c < small.channels; ++c) {
        std::uint32_t sum = count / 2;
        for (std::size_t v = y * factor; v < (y + 1) * factor; ++v)
          for (std::size_t u = x * factor; u < (x + 1) * factor; ++u)
            sum += image.values[v * row + u * image.channels + c];
        small.values.push_back(static_cast<std::uint8_t>(sum / count));
      }
  return small;
}

Image side_by_side(const std::vector<Image>& images) {
  Image all{0, images.front().height, images.front().channels, {}};
  for (const Image& image : images)
    all.width += image.width;
  for (std::size_t y = 0; y < all.height; ++y)
    for (const Image& image : images) {
      const std::size_t row = std::size_t{image.width} * image.channels;
      const auto from = image.values.begin() + static_cast<std::ptrdiff_t>(y * row);
      all.values.insert(all.values.end(), from, from + static_cast<std::ptrdiff_t>(row));
    }
  return all;
}

std::string image_digest(const Image& image) {
  Digest digest;
  digest.add(image.values);
  return digest.hex();
}

} // namespace gewebe::texture
