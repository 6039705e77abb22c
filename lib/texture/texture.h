#pragma once
// Textures as all ways of drawing read them.

#include "texture/image.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::texture {

enum class TextureFilter : std::uint8_t {
  nearest,
  linear, ///< bilinear
  mipmap  ///< bilinear on two levels and linear between them where the texture shrinks
};
enum class TextureWrap : std::uint8_t { repeat, clamp, mirror };

/// "nearest", "linear", "mipmap"; "repeat", "clamp", "mirror".
const std::vector<std::string>& texture_filter_names();
const std::vector<std::string>& texture_wrap_names();
/// \throw Error if there is no such filter or wrap
TextureFilter texture_filter_from_name(std::string_view name);
TextureWrap texture_wrap_from_name(std::string_view name);

/// What a texture is beside its pixels.
struct TextureOptions {
  TextureFilter filter = TextureFilter::linear;
  TextureWrap wrap = TextureWrap::repeat;
  bool sphere = false; ///< seen as a mirror sees its surroundings, not by the mesh's coordinates
};

struct TextureLevel {
  std::uint32_t width = 0, height = 0;
  std::size_t first = 0; ///< its first texel
};

/// Texel (0, 0) is the lower left one, its centre at s = 1/2 width, t = 1/2 height: an image's
/// lower left corner has the coordinates (0, 0), its upper right one (1, 1).
struct Texture {
  TextureOptions options;
  std::uint32_t channels = 3;       ///< 1 or 3
  std::vector<TextureLevel> levels; ///< 0 is the image; further ones for mipmap alone
  /// Rows from the bottom. Colours: red, green, blue from the lowest byte on. Gray: 16 bits, above
  /// them those of the right neighbour (the row's first texel where the texture repeats), so that
  /// two reads do for a bilinear value. Copies of a texture share them.
  std::shared_ptr<const std::vector<std::uint32_t>> texels;

  std::uint32_t width() const { return levels.front().width; }
  std::uint32_t height() const { return levels.front().height; }
};

/// Each level has half the sides of the one before, rounded down, at least 1; its texels are the
/// means over the area that they cover. \throw Error if the image has no pixel
Texture texture_from(const Image& image, const TextureOptions& options = {});
/// Of one channel with 16 bits.
Texture texture_from(const Heights& heights, const TextureOptions& options = {});

/// The bilinear value of level 0 at (s, t), 0 … 1; a gray texture gives three equal values. \pre s
/// and t are finite
std::array<double, 3> sample(const Texture& texture, double s, double t);

/// The 8 or 16 bits of a channel as 0 … 1. \pre x, y inside the level
std::array<double, 3> texel(const Texture& texture, std::size_t level, std::uint32_t x,
                            std::uint32_t y);

} // namespace gewebe::texture
