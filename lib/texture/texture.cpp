#include "texture/texture.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe::texture {
namespace {

/// Pixels as they are halved: `channels` values each, rows from the bottom.
struct Plane {
  std::uint32_t width, height, channels;
  std::vector<std::uint16_t> values;
};

/// Output texel i covers source [i n / m, (i + 1) n / m): at most three, by weights of sum n.
Plane halved(const Plane& from) {
  Plane to{std::max(1U, from.width / 2), std::max(1U, from.height / 2), from.channels, {}};
  to.values.reserve(std::size_t{to.width} * to.height * to.channels);
  const auto overlap = [](std::uint64_t i, std::uint64_t j, std::uint64_t n, std::uint64_t m) {
    return std::min((i + 1) * n, (j + 1) * m) - std::max(i * n, j * m);
  };
  const std::uint64_t area = std::uint64_t{from.width} * from.height;
  for (std::uint64_t y = 0; y < to.height; ++y)
    for (std::uint64_t x = 0; x < to.width; ++x)
      for (std::size_t c = 0; c < to.channels; ++c) {
        std::uint64_t sum = area / 2;
        for (std::uint64_t v = y * from.height / to.height; v * to.height < (y + 1) * from.height;
             ++v)
          for (std::uint64_t u = x * from.width / to.width; u * to.width < (x + 1) * from.width;
               ++u)
            sum += overlap(y, v, from.height, to.height) * overlap(x, u, from.width, to.width) *
                   from.values[(v * from.width + u) * from.channels + c];
        to.values.push_back(static_cast<std::uint16_t>(sum / area));
      }
  return to;
}

void append_level(Texture& texture, std::vector<std::uint32_t>& texels, const Plane& plane) {
  texture.levels.push_back({plane.width, plane.height, texels.size()});
  const bool repeats = texture.options.wrap == TextureWrap::repeat;
  for (std::size_t y = 0; y < plane.height; ++y)
    for (std::size_t x = 0; x < plane.width; ++x) {
      const std::uint16_t* const value = &plane.values[(y * plane.width + x) * plane.channels];
      if (plane.channels == 1) {
        const std::size_t right = x + 1 < plane.width ? x + 1 : (repeats ? 0 : x);
        texels.push_back(*value | std::uint32_t{plane.values[y * plane.width + right]} << 16);
      } else {
        texels.push_back(value[0] | std::uint32_t{value[1]} << 8 | std::uint32_t{value[2]} << 16);
      }
    }
}

Texture texture_of(Plane plane, const TextureOptions& options) {
  if (plane.width == 0 || plane.height == 0)
    throw Error("the image has no pixel, expected one at least");
  Texture texture;
  texture.options = options;
  texture.channels = plane.channels;
  std::vector<std::uint32_t> texels;
  append_level(texture, texels, plane);
  if (options.filter == TextureFilter::mipmap)
    while (plane.width > 1 || plane.height > 1) {
      plane = halved(plane);
      append_level(texture, texels, plane);
    }
  texture.texels = std::make_shared<const std::vector<std::uint32_t>>(std::move(texels));
  return texture;
}

template <class Enum>
Enum from_name(const std::vector<std::string>& names, std::string_view name, const char* what) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end())
    throw Error(std::string(what) + " '" + std::string(name) + "' is unknown, expected " +
                names[0] + ", " + names[1] + " or " + names[2]);
  return static_cast<Enum>(found - names.begin());
}

/// The two neighbours along one axis and the weight of the second.
double neighbours(double x, std::uint32_t count, TextureWrap wrap, std::uint32_t& a,
                  std::uint32_t& b) {
  const auto last = static_cast<double>(count - 1);
  if (wrap == TextureWrap::repeat) {
    const double at = (x - std::floor(x)) * count - 0.5;
    const double below = std::floor(at); // -1 … count - 1, count if x - floor(x) rounds to 1
    a = below < 0 ? count - 1 : static_cast<std::uint32_t>(below) % count;
    b = a + 1 == count ? 0 : a + 1;
    return at - below;
  }
  if (wrap == TextureWrap::mirror) {
    x -= 2 * std::floor(x / 2);
    x = x > 1 ? 2 - x : x;
  }
  const double at = std::clamp(std::clamp(x, -1.0, 2.0) * count - 0.5, 0.0, last);
  a = static_cast<std::uint32_t>(at);
  b = std::min(a + 1, count - 1);
  return at - a;
}

} // namespace

const std::vector<std::string>& texture_filter_names() {
  static const std::vector<std::string> names{"nearest", "linear", "mipmap"};
  return names;
}

const std::vector<std::string>& texture_wrap_names() {
  static const std::vector<std::string> names{"repeat", "clamp", "mirror"};
  return names;
}

TextureFilter texture_filter_from_name(std::string_view name) {
  return from_name<TextureFilter>(texture_filter_names(), name, "filter");
}

TextureWrap texture_wrap_from_name(std::string_view name) {
  return from_name<TextureWrap>(texture_wrap_names(), name, "wrap");
}

Texture texture_from(const Image& image, const TextureOptions& options) {
  Plane plane{image.width, image.height, image.channels, {}};
  plane.values.reserve(image.values.size());
  const std::size_t row = std::size_t{image.width} * image.channels;
  const unsigned factor = image.channels == 1 ? 257 : 1; // 255 becomes 65535
  for (std::size_t y = image.height; y-- > 0;)
    for (std::size_t x = 0; x < row; ++x)
      plane.values.push_back(static_cast<std::uint16_t>(factor * image.values[y * row + x]));
  return texture_of(std::move(plane), options);
}

Texture texture_from(const Heights& heights, const TextureOptions& options) {
  Plane plane{heights.width, heights.height, 1, {}};
  plane.values.reserve(heights.values.size());
  for (std::size_t y = heights.height; y-- > 0;)
    for (std::size_t x = 0; x < heights.width; ++x)
      plane.values.push_back(heights.values[y * heights.width + x]);
  return texture_of(std::move(plane), options);
}

std::array<double, 3> texel(const Texture& texture, std::size_t level, std::uint32_t x,
                            std::uint32_t y) {
  const TextureLevel& l = texture.levels[level];
  const std::uint32_t value = (*texture.texels)[l.first + std::size_t{y} * l.width + x];
  if (texture.channels == 1) {
    const double gray = (value & 0xffffU) / 65535.0;
    return {gray, gray, gray};
  }
  return {(value & 0xffU) / 255.0, (value >> 8 & 0xffU) / 255.0, (value >> 16 & 0xffU) / 255.0};
}

std::array<double, 3> sample(const Texture& texture, double s, double t) {
  std::uint32_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  const double fx = neighbours(s, texture.width(), texture.options.wrap, x0, x1);
  const double fy = neighbours(t, texture.height(), texture.options.wrap, y0, y1);
  const auto a = texel(texture, 0, x0, y0), b = texel(texture, 0, x1, y0),
             c = texel(texture, 0, x0, y1), d = texel(texture, 0, x1, y1);
  std::array<double, 3> value{};
  for (std::size_t n = 0; n < 3; ++n) {
    const double low = a[n] + fx * (b[n] - a[n]), high = c[n] + fx * (d[n] - c[n]);
    value[n] = low + fy * (high - low);
  }
  return value;
}

} // namespace gewebe::texture
