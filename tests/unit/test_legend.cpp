#include "texture/legend.h"

#include "tests/unit/larger.h"
#include "text/round_axis.h"
#include "texture/lettering.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <string>

namespace gewebe::test {
namespace {

texture::Image gray(std::uint32_t width, std::uint32_t height) {
  return {width, height, 3, std::vector<std::uint8_t>(std::size_t{3} * width * height, 128)};
}

texture::PixelColor pixel(const texture::Image& image, std::size_t x, std::size_t y) {
  const std::uint8_t* const p = &image.values[3 * (y * image.width + x)];
  return {p[0], p[1], p[2]};
}

/// Columns and rows that differ from gray: least and greatest of both.
std::array<std::size_t, 4> changed(const texture::Image& image) {
  std::array<std::size_t, 4> box{image.width, 0, image.height, 0};
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x)
      if (pixel(image, x, y) != texture::PixelColor{128, 128, 128}) {
        box = {std::min(box[0], x), std::max(box[1], x), std::min(box[2], y), std::max(box[3], y)};
      }
  return box;
}

TEST(Legend, LettersFillTheirWidthAndHeight) {
  texture::Image image = gray(100, 60);
  const texture::LetteringStyle style{24, {0, 0, 0}, {128, 128, 128}};
  EXPECT_DOUBLE_EQ(texture::lettering_width("H", 24), 16);
  EXPECT_DOUBLE_EQ(texture::lettering_width("", 24), 0);
  EXPECT_DOUBLE_EQ(texture::lettering_width("HH", 24), 2 * 16 + 1.7 * 4);
  texture::draw_lettering(image, 20, 40, "H", style);
  EXPECT_EQ(changed(image), (std::array<std::size_t, 4>{18, 37, 14, 41}));
  EXPECT_EQ(pixel(image, 20, 30), (texture::PixelColor{0, 0, 0}));       // the left stroke
  EXPECT_EQ(pixel(image, 28, 20), (texture::PixelColor{128, 128, 128})); // between the strokes
}

TEST(Legend, EachPrintableLetterDiffersFromTheOthers) {
  std::vector<texture::Image> seen;
  std::string all = "\u00b5";
  for (char c = '!'; c <= '~'; ++c)
    all += c;
  for (std::size_t k = 0; k < all.size(); k += k == 0 ? 2 : 1) {
    texture::Image image = gray(40, 50);
    texture::draw_lettering(image, 5, 35, all.substr(k, k == 0 ? 2 : 1), {});
    for (const texture::Image& other : seen)
      EXPECT_NE(image, other) << all[k];
    seen.push_back(std::move(image));
  }
  texture::Image unknown = gray(40, 50), broken = unknown;
  texture::draw_lettering(unknown, 5, 35, "\u00e4", {});
  texture::draw_lettering(broken, 5, 35, "\xff", {});
  EXPECT_EQ(unknown, broken);
  EXPECT_NE(unknown, gray(40, 50));
}

TEST(Legend, WhatLiesBeyondThePictureIsLeftOut) {
  for (const double x : {-1e9, -10.0, 35.0, 1e9})
    for (const double y : {-1e9, 2.0, 60.0, 1e9}) {
      texture::Image image = gray(40, 50);
      texture::draw_lettering(image, x, y, "mm", {});
      texture::fill_rectangle(image, {x, y}, {x + 9, y + 9}, {0, 0, 0});
      EXPECT_EQ(image.values.size(), 6000U);
    }
  texture::Image image = gray(4, 1);
  texture::fill_rectangle(image, {0.5, 0}, {2, 1}, {0, 0, 0});
  EXPECT_EQ(pixel(image, 0, 0)[0], 64);
  EXPECT_EQ(pixel(image, 1, 0)[0], 0);
  EXPECT_EQ(pixel(image, 2, 0)[0], 128);
}

TEST(Legend, LengthsAreRound) {
  EXPECT_EQ(text::round_length(49), 20);
  EXPECT_EQ(text::round_length(50), 50);
  EXPECT_EQ(text::round_length(0.07), 0.05);
  EXPECT_EQ(text::round_length(1), 1);
  EXPECT_EQ(text::round_length(0), 0);
  EXPECT_EQ(text::round_length(std::nan("")), 0);
  EXPECT_EQ(text::round_length(HUGE_VAL), 0);
}

TEST(Legend, BarAndScaleShowWhatTheySay) {
  texture::Image image = gray(420, 420);
  texture::Legend legend;
  legend.bar = texture::LegendBar{"u [mm]", {0, 4}, texture::color_ramp_from_name("viridis")};
  legend.mm_per_pixel = 0.5; // 20 mm on 40 pixels
  legend.time = 0.25;
  texture::draw_legend(image, legend, {0.5, 0.5, 0.5});
  // Letters of 10 pixels: the bar is 15 wide and 189 high, at 14 from the right and 40 from above.
  EXPECT_EQ(pixel(image, 398, 228), (texture::PixelColor{68, 2, 85}));
  EXPECT_EQ(pixel(image, 398, 40), (texture::PixelColor{251, 231, 36}));
  EXPECT_EQ(pixel(image, 398, 134), (texture::PixelColor{33, 144, 141}));
  EXPECT_EQ(pixel(image, 14 + 99, 405), (texture::PixelColor{0, 0, 0}));
  EXPECT_NE(pixel(image, 14 + 101, 405), (texture::PixelColor{0, 0, 0}));
}

/// Lightness of CIE 1976 of a colour of sRGB.
double lightness(const std::array<double, 3>& color) {
  double y = 0;
  const std::array<double, 3> weights{0.2126, 0.7152, 0.0722};
  for (std::size_t k = 0; k < 3; ++k) {
    const double c = color[k] / 255;
    y += weights[k] * (c > 0.04045 ? std::pow((c + 0.055) / 1.055, 2.4) : c / 12.92);
  }
  return y > 0.008856 ? 116 * std::cbrt(y) - 16 : 903.3 * y;
}

TEST(Legend, UniformRampsGetLighterInEqualSteps) {
  for (const std::string name : {"viridis", "cividis", "rainbow"}) {
    const texture::ColorRamp ramp = texture::color_ramp_from_name(name);
    double least = HUGE_VAL, greatest = -HUGE_VAL;
    for (int k = 0; k < 16; ++k) {
      const double step = lightness(texture::ramp_color(ramp, (k + 1) / 16.0)) -
                          lightness(texture::ramp_color(ramp, k / 16.0));
      least = test::smaller(least, step);
      greatest = test::larger(greatest, step);
    }
    const bool uniform = least > 0 && greatest < 2 * least;
    EXPECT_EQ(uniform, name != "rainbow") << name << " " << least << " " << greatest;
  }
}

} // namespace
} // namespace gewebe::test
