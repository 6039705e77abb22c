#pragma once
// Texts on pictures, in a stroke font of our own: each letter is a few lines of even width.

#include "texture/image.h"

#include <array>
#include <cstdint>
#include <string_view>

namespace gewebe::texture {

using PixelColor = std::array<std::uint8_t, 3>;

struct LetteringStyle {
  double size = 12;               ///< height of capitals, px
  PixelColor color{0, 0, 0};      ///< of the letters
  PixelColor halo{255, 255, 255}; ///< around them, so that they are legible on anything
};

/// Width of a text in px. Printable ASCII and the sign of micro (UTF-8) have letters; other
/// characters are boxes.
double lettering_width(std::string_view text, double size);

/// Draws a text whose first letter begins at x, on the line y, both in px from the upper left
/// corner. What lies beyond the picture is left out. \pre the picture has 3 channels
void draw_lettering(Image& picture, double x, double y, std::string_view text,
                    const LetteringStyle& style);

/// Fills a rectangle; pixels at its edges in part. \pre as draw_lettering
void fill_rectangle(Image& picture, const std::array<double, 2>& from,
                    const std::array<double, 2>& to, const PixelColor& color);

} // namespace gewebe::texture
