#include "texture/lettering.h"

#include "text/utf8.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gewebe::texture {

namespace {

/// Strokes of the letters from the blank on, each a list of points x y: x from 0, y from the line
/// up, capitals 6 high, small letters 4; a and b are 1 and 2 below the line.
constexpr std::array<std::string_view, 95> letters{
    "",                                                // blank
    "06 02,00 00",                                     // !
    "06 05,16 15",                                     // "
    "10 16,30 36,02 42,04 44",                         // #
    "45 36 16 05 04 13 33 42 41 30 10 01,27 2a",       // $
    "00 46,05 16 25 14 05,21 32 41 30 21",             // %
    "40 05 16 25 02 01 10 20 42",                      // &
    "06 05",                                           // '
    "16 05 01 10",                                     // (
    "06 15 11 00",                                     // )
    "21 25,12 34,14 32",                               // *
    "03 43,21 25",                                     // +
    "10 0a",                                           // ,
    "03 33",                                           // -
    "00 00",                                           // .
    "00 36",                                           // /
    "10 30 41 45 36 16 05 01 10",                      // 0
    "15 26 20,10 30",                                  // 1
    "05 16 36 45 44 00 40",                            // 2
    "05 16 36 45 44 33 13,33 42 41 30 10 01",          // 3
    "30 36 02 42",                                     // 4
    "46 06 03 33 42 41 30 10 01",                      // 5
    "36 16 05 01 10 30 41 42 33 03",                   // 6
    "06 46 10",                                        // 7
    "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33", // 8
    "10 30 41 45 36 16 05 04 13 43",                   // 9
    "01 01,04 04",                                     // :
    "10 0a,14 14",                                     // ;
    "45 03 41",                                        // <
    "02 42,04 44",                                     // =
    "05 43 01",                                        // >
    "05 16 26 35 34 23 22,20 20",                      // ?
    "42 32 23 13 02 11 21 32,42 44 35 15 04 01 10 30", // @
    "00 26 40,12 32",                                  // A
    "00 06 36 45 44 33 03,33 42 41 30 00",             // B
    "45 36 16 05 01 10 30 41",                         // C
    "00 06 26 44 42 20 00",                            // D
    "46 06 00 40,03 33",                               // E
    "46 06 00,03 33",                                  // F
    "45 36 16 05 01 10 30 41 43 23",                   // G
    "00 06,40 46,03 43",                               // H
    "00 06",                                           // I
    "36 31 20 10 01",                                  // J
    "00 06,46 02,13 40",                               // K
    "06 00 40",                                        // L
    "00 06 23 46 40",                                  // M
    "00 06 40 46",                                     // N
    "10 30 42 44 36 16 04 02 10",                      // O
    "00 06 36 45 44 33 03",                            // P
    "10 30 42 44 36 16 04 02 10,22 40",                // Q
    "00 06 36 45 44 33 03,23 40",                      // R
    "45 36 16 05 04 13 33 42 41 30 10 01",             // S
    "06 46,26 20",                                     // T
    "06 01 10 30 41 46",                               // U
    "06 20 46",                                        // V
    "06 10 23 30 46",                                  // W
    "00 46,06 40",                                     // X
    "06 23 46,23 20",                                  // Y
    "06 46 00 40",                                     // Z
    "16 06 0a 1a",                                     // [
    "06 30",                                           // backslash
    "06 16 1a 0a",                                     // ]
    "04 26 44",                                        // ^
    "0a 4a",                                           // _
    "06 15",                                           // `
    "34 30,33 24 14 03 01 10 20 31",                   // a
    "06 00,03 14 24 33 31 20 10 01",                   // b
    "33 24 14 03 01 10 20 31",                         // c
    "36 30,33 24 14 03 01 10 20 31",                   // d
    "02 32 33 24 14 03 01 10 20 31",                   // e
    "26 15 10,04 24",                                  // f
    "34 3a 2b 1b 0a,33 24 14 03 01 10 20 31",          // g
    "06 00,03 14 24 33 30",                            // h
    "04 00,06 06",                                     // i
    "14 1a 0b,16 16",                                  // j
    "06 00,34 01,12 30",                               // k
    "06 01 10",                                        // l
    "04 00,03 14 23 20,23 34 43 40",                   // m
    "04 00,03 14 24 33 30",                            // n
    "10 20 31 33 24 14 03 01 10",                      // o
    "04 0b,03 14 24 33 31 20 10 01",                   // p
    "34 3b,33 24 14 03 01 10 20 31",                   // q
    "04 00,02 14 24",                                  // r
    "33 24 14 03 12 22 31 20 10 01",                   // s
    "16 11 20,04 24",                                  // t
    "04 01 10 20 31,34 30",                            // u
    "04 20 44",                                        // v
    "04 10 22 30 44",                                  // w
    "04 30,00 34",                                     // x
    "04 20,44 20 1b 0b",                               // y
    "04 34 00 30",                                     // z
    "26 15 14 03 12 11 20",                            // {
    "0b 06",                                           // |
    "06 15 14 23 12 11 00",                            // }
    "03 14 32 43",                                     // ~
};
constexpr std::string_view micro = "04 0b,01 10 20 31,34 30", box = "00 06 36 30 00";
constexpr double capital = 6, gap = 1.7, blank = 2.4;

struct Point {
  double x = 0, y = 0;
};
struct Stroke {
  Point from, to;
};

double height_of(char c) {
  return c == 'a' ? -1 : c == 'b' ? -2 : c - '0';
}

/// Strokes of the character that the text begins with, which is taken away. The blank has none.
std::string_view take_glyph(std::string_view& text) {
  const std::size_t size = std::max<std::size_t>(text::utf8_size(text), 1);
  const std::string_view character = text.substr(0, size);
  text.remove_prefix(size);
  const char c = character[0];
  if (size == 1 && c >= ' ' && c <= '~')
    return letters[static_cast<std::size_t>(c - ' ')];
  return character == "\u00b5" ? micro : box;
}

double width_of(std::string_view glyph) {
  double width = glyph.empty() ? blank : 0;
  for (std::size_t k = 0; k + 1 < glyph.size(); k += 3)
    width = std::max(width, static_cast<double>(glyph[k] - '0'));
  return width;
}

/// Strokes of a text in px.
std::vector<Stroke> strokes_of(std::string_view text, double x, double y, double unit) {
  std::vector<Stroke> strokes;
  while (!text.empty()) {
    const std::string_view glyph = take_glyph(text);
    Point last;
    for (std::size_t k = 0; k + 1 < glyph.size(); k += 3) {
      const Point p{x + unit * (glyph[k] - '0'), y - unit * height_of(glyph[k + 1])};
      if (k > 0 && glyph[k - 1] == ' ')
        strokes.push_back({last, p});
      last = p;
    }
    x += unit * (width_of(glyph) + gap);
  }
  return strokes;
}

double distance(const Stroke& s, const Point& p) {
  const double dx = s.to.x - s.from.x, dy = s.to.y - s.from.y, square = dx * dx + dy * dy;
  const double along =
      square > 0 ? std::clamp(((p.x - s.from.x) * dx + (p.y - s.from.y) * dy) / square, 0.0, 1.0)
                 : 0.0;
  const double x = p.x - s.from.x - along * dx, y = p.y - s.from.y - along * dy;
  return std::sqrt(x * x + y * y);
}

/// Mixes a share of a colour into a pixel.
void blend(Image& picture, std::size_t x, std::size_t y, const PixelColor& color, double share) {
  for (std::size_t k = 0; k < 3; ++k) {
    std::uint8_t& value = picture.values[(y * picture.width + x) * 3 + k];
    value = static_cast<std::uint8_t>(std::floor(value + (color[k] - value) * share + 0.5));
  }
}

/// Pixels from `low` to `high`, both in px, cut to those from 0 to `count`.
std::array<std::size_t, 2> pixel_range(double low, double high, std::uint32_t count) {
  const double most = count;
  return {static_cast<std::size_t>(std::clamp(std::floor(low), 0.0, most)),
          static_cast<std::size_t>(std::clamp(std::ceil(high), 0.0, most))};
}

/// Distances of pixels to the strokes, as far as `reach`, drawn in a colour up to `radius`.
void draw_strokes(Image& picture, const std::vector<Stroke>& strokes, double radius,
                  const PixelColor& color) {
  if (strokes.empty())
    return;
  double left = HUGE_VAL, right = -HUGE_VAL, top = HUGE_VAL, bottom = -HUGE_VAL;
  for (const Stroke& s : strokes)
    for (const Point& p : {s.from, s.to}) {
      left = std::min(left, p.x);
      right = std::max(right, p.x);
      top = std::min(top, p.y);
      bottom = std::max(bottom, p.y);
    }
  const double room = radius + 1;
  const auto [x0, x1] = pixel_range(left - room, right + room, picture.width);
  const auto [y0, y1] = pixel_range(top - room, bottom + room, picture.height);
  if (x0 >= x1 || y0 >= y1)
    return;
  const std::size_t width = x1 - x0;
  std::vector<double> nearest(width * (y1 - y0), HUGE_VAL);
  for (const Stroke& s : strokes) {
    const auto [a, b] = pixel_range(std::min(s.from.x, s.to.x) - room,
                                    std::max(s.from.x, s.to.x) + room, picture.width);
    const auto [c, d] = pixel_range(std::min(s.from.y, s.to.y) - room,
                                    std::max(s.from.y, s.to.y) + room, picture.height);
    for (std::size_t y = c; y < d; ++y)
      for (std::size_t x = a; x < b; ++x) {
        double& kept = nearest[(y - y0) * width + x - x0];
        kept = std::min(kept,
                        distance(s, {static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5}));
      }
  }
  for (std::size_t y = y0; y < y1; ++y)
    for (std::size_t x = x0; x < x1; ++x)
      if (const double share = radius + 0.5 - nearest[(y - y0) * width + x - x0]; share > 0)
        blend(picture, x, y, color, std::min(share, 1.0));
}

} // namespace

double lettering_width(std::string_view text, double size) {
  double width = 0;
  while (!text.empty())
    width += width_of(take_glyph(text)) + gap;
  return std::max(width - gap, 0.0) * size / capital;
}

void draw_lettering(Image& picture, double x, double y, std::string_view text,
                    const LetteringStyle& style) {
  const std::vector<Stroke> strokes = strokes_of(text, x, y, style.size / capital);
  const double radius = std::max(style.size / 14, 0.6);
  draw_strokes(picture, strokes, radius + std::max(style.size / 8, 1.0), style.halo);
  draw_strokes(picture, strokes, radius, style.color);
}

void fill_rectangle(Image& picture, const std::array<double, 2>& from,
                    const std::array<double, 2>& to, const PixelColor& color) {
  const auto [x0, x1] = pixel_range(from[0], to[0], picture.width);
  const auto [y0, y1] = pixel_range(from[1], to[1], picture.height);
  const auto share = [](std::size_t pixel, double low, double high) {
    const auto at = static_cast<double>(pixel);
    return std::clamp(std::min(at + 1, high) - std::max(at, low), 0.0, 1.0);
  };
  for (std::size_t y = y0; y < y1; ++y)
    for (std::size_t x = x0; x < x1; ++x)
      blend(picture, x, y, color, share(x, from[0], to[0]) * share(y, from[1], to[1]));
}

} // namespace gewebe::texture
