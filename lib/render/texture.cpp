#include "render/texture.h"

#include "base/error.h"

namespace gewebe {

Texture texture_from(const Image& image) {
  if (image.width == 0 || image.height == 0)
    throw Error("the image has no pixel, expected one at least");
  Texture texture{image.width, image.height, image.channels, {}};
  texture.values.reserve(image.values.size());
  const auto row = static_cast<std::ptrdiff_t>(std::size_t{image.width} * image.channels);
  for (auto y = static_cast<std::ptrdiff_t>(image.height); y-- > 0;)
    texture.values.insert(texture.values.end(), image.values.begin() + y * row,
                          image.values.begin() + (y + 1) * row);
  return texture;
}

} // namespace gewebe
