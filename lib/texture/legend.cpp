#include "texture/legend.h"

#include "text/number_text.h"
#include "text/round_axis.h"
#include "texture/lettering.h"

#include <algorithm>
#include <cmath>

namespace gewebe::texture {
namespace {

/// Sizes in px, from the picture's.
struct Layout {
  double width = 0, height = 0, letter = 0, margin = 0;
  LetteringStyle style;
};

Layout layout_of(const Image& picture, const Vec3& background) {
  Layout layout;
  layout.width = picture.width;
  layout.height = picture.height;
  layout.letter = std::clamp(std::min(layout.width, layout.height) / 42, 8.0, 48.0);
  layout.margin = 1.4 * layout.letter;
  layout.style.size = layout.letter;
  constexpr Vec3 weights{0.2126, 0.7152, 0.0722}; // Rec. 709
  if (!(dot(weights, background) >= 0.4))
    std::swap(layout.style.color, layout.style.halo);
  return layout;
}

/// Values as texts with the same number of decimals, at the bar's left.
void draw_bar(Image& picture, const Layout& at, const LegendBar& bar) {
  // Whole pixels, so that no row is mixed twice.
  const double thick = std::round(1.5 * at.letter), long_side = std::round(0.45 * at.height);
  const double right = std::round(at.width - at.margin), left = right - thick;
  const double top = std::round(at.margin + 2.6 * at.letter), bottom = top + long_side;
  draw_lettering(picture, right - lettering_width(bar.title, at.letter), at.margin + at.letter,
                 bar.title, at.style);
  const double rim = std::max(1.0, std::round(at.letter / 10));
  fill_rectangle(picture, {left - rim, top - rim}, {right + rim, bottom + rim}, at.style.color);
  const auto rows = static_cast<std::size_t>(long_side);
  for (std::size_t k = 0; k < rows; ++k) {
    const auto row = static_cast<double>(k);
    const std::array<double, 3> mixed = ramp_color(bar.ramp, 1 - (row + 0.5) / long_side);
    PixelColor color{};
    for (std::size_t c = 0; c < 3; ++c)
      color[c] = static_cast<std::uint8_t>(std::floor(mixed[c] + 0.5));
    fill_rectangle(picture, {left, top + row}, {right, top + row + 1}, color);
  }
  const text::RoundAxis axis = text::round_axis(bar.range[0], bar.range[1], 5);
  const double span = bar.range[1] - bar.range[0];
  for (std::size_t k = 0; k < axis.marks.size(); ++k) {
    const double share = (axis.marks[k] - bar.range[0]) / span;
    if (!(share >= -1e-9 && share <= 1 + 1e-9))
      continue;
    const double y = bottom - share * long_side;
    fill_rectangle(picture, {left - 0.6 * at.letter, y - rim / 2}, {left, y + rim / 2},
                   at.style.color);
    draw_lettering(picture, left - at.letter - lettering_width(axis.texts[k], at.letter),
                   y + at.letter / 2, axis.texts[k], at.style);
  }
}

void draw_scale(Image& picture, const Layout& at, double mm_per_pixel) {
  const double length = text::round_length(0.25 * at.width * mm_per_pixel);
  if (!(length > 0))
    return;
  const double pixels = length / mm_per_pixel, bottom = at.height - at.margin;
  const double thick = std::max(2.0, std::round(at.letter / 4));
  fill_rectangle(picture, {at.margin - 1, bottom - thick - 1}, {at.margin + pixels + 1, bottom + 1},
                 at.style.halo);
  fill_rectangle(picture, {at.margin, bottom - thick}, {at.margin + pixels, bottom},
                 at.style.color);
  draw_lettering(picture, at.margin, bottom - thick - 0.7 * at.letter,
                 text::number_text(length) + " mm", at.style);
}

} // namespace

void draw_legend(Image& picture, const Legend& legend, const Vec3& background) {
  const Layout layout = layout_of(picture, background);
  if (legend.bar)
    draw_bar(picture, layout, *legend.bar);
  if (legend.mm_per_pixel)
    draw_scale(picture, layout, *legend.mm_per_pixel);
  if (legend.time)
    draw_lettering(picture, layout.margin, layout.margin + layout.letter,
                   text::six_digits(*legend.time) + " s", layout.style);
}

} // namespace gewebe::texture
