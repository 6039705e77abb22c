#include "shading/endoscope.h"

#include "texture/surface_material.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace gewebe::shading {

Vec3 endoscope_light(const Camera& camera) {
  return camera.eye + camera.up * endoscope_light_height;
}

void look_through_endoscope(texture::Image& image, const Camera& camera) {
  constexpr double rim = 0.5, flat = 0.35; // of the light's cone
  const double half = std::min(image.width, image.height) / 2.0;
  std::size_t at = 0;
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const double right = x + 0.5 - image.width / 2.0, down = y + 0.5 - image.height / 2.0;
      const double tan_x = right / (image.width / 2.0) * camera.tan_x;
      const double tan_y = down / (image.height / 2.0) * camera.tan_y;
      const double lens = 1 / (1 + tan_x * tan_x + tan_y * tan_y);
      const double from_middle = std::sqrt(right * right + down * down);
      const double s = std::clamp((from_middle / half - flat) / (1 - flat), 0.0, 1.0);
      const double cone = 1 - (1 - rim) * s * s * (3 - 2 * s);
      const double stop = std::clamp(half - from_middle + 0.5, 0.0, 1.0);
      for (int c = 0; c < 3; ++c, ++at)
        image.values[at] = texture::stored(image.values[at] / 255.0 * lens * cone * stop);
    }
}

} // namespace gewebe::shading
