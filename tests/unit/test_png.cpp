// Images from and to files.

#include "base/error.h"
#include "formats/image/image_file.h"
#include "formats/image/png.h"
#include "formats/image/pnm.h"
#include "scratch.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <random>

namespace gewebe::test {
namespace {

texture::Image noise(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  texture::Image image{width, height, channels, {}};
  std::mt19937 random(width);
  for (std::size_t n = 0; n < std::size_t{width} * height * channels; ++n)
    image.values.push_back(static_cast<std::uint8_t>(random() >> 24));
  return image;
}

struct PngOptions {
  int depth = 8, type = PNG_COLOR_TYPE_RGB, interlace = PNG_INTERLACE_NONE;
  bool gamma = false;
};

/// A PNG of any kind, from rows as they stand in it.
std::string make_png(std::uint32_t width, std::uint32_t height, const PngOptions& options,
                     const std::vector<std::vector<std::uint8_t>>& rows) {
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &bytes,
      [](png_structp p, png_bytep data, std::size_t count) {
        static_cast<std::string*>(png_get_io_ptr(p))
            ->append(reinterpret_cast<const char*>(data), count);
      },
      nullptr);
  png_set_IHDR(png, info, width, height, options.depth, options.type, options.interlace,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (options.type == PNG_COLOR_TYPE_PALETTE) {
    const std::array<png_color, 4> palette{{{1, 2, 3}, {10, 20, 30}, {100, 110, 120}, {0, 0, 255}}};
    png_set_PLTE(png, info, palette.data(), 4);
    std::array<png_byte, 2> alpha{0, 128};
    png_set_tRNS(png, info, alpha.data(), 2, nullptr);
  }
  if (options.gamma)
    png_set_gAMA(png, info, 1.0);
  png_write_info(png, info);
  const int passes = png_set_interlace_handling(png);
  for (int pass = 0; pass < passes; ++pass)
    for (const auto& row : rows)
      png_write_row(png, row.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

TEST(Png, RoundTripAndSameBytesTwice) {
  for (const std::uint32_t channels : {1U, 3U})
    for (const auto& [w, h] : {std::pair{1U, 1U}, {7U, 5U}, {300U, 200U}}) {
      const texture::Image image = noise(w, h, channels);
      const std::string bytes = formats::write_png(image);
      EXPECT_EQ(formats::read_png(bytes, "x"), image);
      EXPECT_EQ(formats::write_png(image), bytes);
      EXPECT_EQ(bytes.find("tIME"), std::string::npos);
    }
}

TEST(Png, EveryKindGivesItsStoredValues) {
  EXPECT_EQ(formats::read_png(
                make_png(3, 1, {16, PNG_COLOR_TYPE_GRAY}, {{0, 0, 128, 127, 255, 255}}), "x"),
            (texture::Image{3, 1, 1, {0, 128, 255}})); // 32895 / 257 = 127.996
  // The nearest, not the upper byte: 255 / 257 = 0.99, 65024 / 257 = 253.01, 128 / 257 = 0.498.
  EXPECT_EQ(
      formats::read_png(make_png(3, 1, {16, PNG_COLOR_TYPE_GRAY}, {{0, 255, 254, 0, 0, 128}}), "x"),
      (texture::Image{3, 1, 1, {1, 253, 0}}));
  EXPECT_EQ(formats::read_png(make_png(4, 1, {2, PNG_COLOR_TYPE_GRAY}, {{0b00011011}}), "x"),
            (texture::Image{4, 1, 1, {0, 85, 170, 255}}));
  EXPECT_EQ(formats::read_png(make_png(4, 1, {2, PNG_COLOR_TYPE_PALETTE}, {{0b00011011}}), "x"),
            (texture::Image{4, 1, 3, {1, 2, 3, 10, 20, 30, 100, 110, 120, 0, 0, 255}}));
  EXPECT_EQ(formats::read_png(make_png(1, 1, {8, PNG_COLOR_TYPE_RGBA}, {{9, 8, 7, 0}}), "x"),
            (texture::Image{1, 1, 3, {9, 8, 7}}));
  EXPECT_EQ(
      formats::read_png(make_png(2, 1, {8, PNG_COLOR_TYPE_GRAY_ALPHA}, {{9, 0, 8, 255}}), "x"),
      (texture::Image{2, 1, 1, {9, 8}}));
  PngOptions odd;
  odd.gamma = true;
  EXPECT_EQ(formats::read_png(make_png(1, 1, odd, {{9, 8, 7}}), "x"),
            (texture::Image{1, 1, 3, {9, 8, 7}}));
}

TEST(Png, SixteenBitsAreKeptWhereTheyAreAskedFor) {
  EXPECT_EQ(formats::read_deep_png(
                make_png(3, 1, {16, PNG_COLOR_TYPE_GRAY}, {{0, 7, 128, 127, 255, 254}}), "x"),
            (texture::DeepImage{3, 1, 1, {7, 0x807f, 0xfffe}}));
  EXPECT_EQ(formats::read_deep_png(
                make_png(1, 1, {16, PNG_COLOR_TYPE_RGBA}, {{1, 2, 3, 4, 5, 6, 0, 0}}), "x"),
            (texture::DeepImage{1, 1, 3, {0x102, 0x304, 0x506}}));
  EXPECT_EQ(formats::read_deep_png(make_png(4, 1, {2, PNG_COLOR_TYPE_GRAY}, {{0b00011011}}), "x"),
            (texture::DeepImage{4, 1, 1, {0, 85 * 257, 170 * 257, 65535}}));
  EXPECT_EQ(
      formats::read_deep_png(make_png(2, 1, {2, PNG_COLOR_TYPE_PALETTE}, {{0b00010000}}), "x"),
      (texture::DeepImage{2, 1, 3, {257, 514, 771, 2570, 5140, 7710}}));
  EXPECT_EQ(
      formats::read_deep_png(make_png(2, 1, {8, PNG_COLOR_TYPE_GRAY_ALPHA}, {{9, 0, 8, 255}}), "x"),
      (texture::DeepImage{2, 1, 1, {9 * 257, 8 * 257}}));
  const texture::Image image = noise(21, 13, 3);
  const texture::DeepImage deep = formats::read_deep_png(formats::write_png(image), "x");
  ASSERT_EQ(deep.values.size(), image.values.size());
  for (std::size_t n = 0; n < deep.values.size(); ++n)
    EXPECT_EQ(deep.values[n], image.values[n] * 257);
}

TEST(Png, InterlacedIsTheSameImage) {
  const texture::Image image = noise(21, 13, 3);
  std::vector<std::vector<std::uint8_t>> rows;
  for (std::size_t y = 0; y < 13; ++y)
    rows.emplace_back(image.values.begin() + static_cast<std::ptrdiff_t>(63 * y),
                      image.values.begin() + static_cast<std::ptrdiff_t>(63 * (y + 1)));
  PngOptions options;
  options.interlace = PNG_INTERLACE_ADAM7;
  EXPECT_EQ(formats::read_png(make_png(21, 13, options, rows), "x"), image);
}

void expect_refused(const std::function<texture::Image()>& read, const std::string& part) {
  try {
    (void)read();
    ADD_FAILURE() << "nothing thrown, expected " << part;
  } catch (const Error& error) {
    EXPECT_NE((error.place() + ": " + error.what()).find(part), std::string::npos)
        << error.place() << ": " << error.what();
  }
}

TEST(Png, EveryTruncationAndEveryBrokenByteIsAnErrorOrAnImage) {
  const std::string bytes = formats::write_png(noise(9, 6, 3));
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_THROW((void)formats::read_png(bytes.substr(0, n), "x"), Error) << n;
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    std::string broken = bytes;
    broken[n] = static_cast<char>(broken[n] ^ 0x41);
    try {
      (void)formats::read_png(broken, "x");
    } catch (const Error&) {
    }
  }
  expect_refused([&] { return formats::read_png(bytes.substr(0, 40), "x.png"); },
                 "x.png: byte 40: ");
  expect_refused([&] { return formats::read_png("GIF", "x"); }, "x: byte ");
}

/// The head of a PNG that claims w × h pixels, with a right checksum, and nothing behind it.
std::string claim(std::uint32_t w, std::uint32_t h) {
  std::string head("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16);
  for (const std::uint32_t n : {w, h})
    for (int shift = 24; shift >= 0; shift -= 8)
      head += static_cast<char>(n >> shift);
  head += std::string("\x08\x02\0\0\0", 5);
  std::uint32_t crc = 0xffffffff;
  for (std::size_t n = 12; n < head.size(); ++n) {
    crc ^= static_cast<unsigned char>(head[n]);
    for (int bit = 0; bit < 8; ++bit)
      crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xedb88320U : 0U);
  }
  crc = ~crc;
  for (int shift = 24; shift >= 0; shift -= 8)
    head += static_cast<char>(crc >> shift);
  return head + std::string("\0\0\0\x10IDAT", 8) + std::string(20, 'x');
}

TEST(Png, AbsurdSizesTakeNoMemory) {
  expect_refused([] { return formats::read_png(claim(2000000000, 2000000000), "x"); }, "x: byte ");
  expect_refused([] { return formats::read_png(claim(30000, 30000), "x"); },
                 "30000 x 30000 pixels in ");
}

TEST(Pnm, AllFourKinds) {
  EXPECT_EQ(formats::read_pnm("P2 3 1 255\n0 128 255\n", "x"),
            (texture::Image{3, 1, 1, {0, 128, 255}}));
  EXPECT_EQ(formats::read_pnm("P2#c\n3#c\n1 5 # x\n0 1\t5", "x"),
            (texture::Image{3, 1, 1, {0, 51, 255}}));
  EXPECT_EQ(formats::read_pnm("P3 1 2 65535 0 65535 32768 1 2 3", "x"),
            (texture::Image{1, 2, 3, {0, 255, 128, 0, 0, 0}}));
  EXPECT_EQ(formats::read_pnm("P2 4 1 65535 128 129 65406 65407", "x"),
            (texture::Image{4, 1, 1, {0, 1, 254, 255}}));
  EXPECT_EQ(formats::read_pnm("P5 2 1 255\n#a", "x"), (texture::Image{2, 1, 1, {'#', 'a'}}));
  EXPECT_EQ(formats::read_pnm(std::string("P5 1 1 65535\n\xff\0", 15), "x"),
            (texture::Image{1, 1, 1, {254}}));
  EXPECT_EQ(formats::read_pnm("P6 1 1 255\nabc", "x"), (texture::Image{1, 1, 3, {'a', 'b', 'c'}}));
  const texture::Image image = noise(20, 10, 3);
  EXPECT_EQ(formats::read_pnm(formats::write_ppm(image), "x"), image);
}

TEST(Pnm, SixteenBitsAreKeptWhereTheyAreAskedFor) {
  EXPECT_EQ(formats::read_deep_pnm("P2 3 1 65535 0 65535\n32769 ", "x"),
            (texture::DeepImage{3, 1, 1, {0, 65535, 32769}}));
  EXPECT_EQ(formats::read_deep_pnm("P3 1 1 255 0 1 255", "x"),
            (texture::DeepImage{1, 1, 3, {0, 257, 65535}}));
  EXPECT_EQ(formats::read_deep_pnm("P2 2 1 1000 1 #\n 1000", "x"),
            (texture::DeepImage{2, 1, 1, {66, 65535}}));
  EXPECT_EQ(formats::read_deep_pnm(std::string("P5 1 1 65535\n\xff\0", 15), "x"),
            (texture::DeepImage{1, 1, 1, {0xff00}}));
  EXPECT_EQ(formats::read_deep_pnm("P2 2 1 255 0000000012 00001", "x"),
            (texture::DeepImage{2, 1, 1, {3084, 257}}));
}

TEST(Pnm, BadFilesAreOneLine) {
  const auto refused = [](const std::string& bytes, const std::string& part) {
    expect_refused([&] { return formats::read_pnm(bytes, "x"); }, part);
  };
  refused("P1 1 1 1", "x:1: no PNM");
  refused("", "x:1: no PNM");
  refused("P2\n0 1 255 ", "x:2: no width");
  refused("P2 1 40000 255 ", "no height, expected 1 to 32768");
  refused("P2 1 1 65536 1", "no maxval");
  refused("P2 1 1", "ends before the maxval");
  refused("P2 2 1 255 7", "too few bytes for 2 values");
  refused("P2 2 1 255 255 \n", "ends before the value");
  refused("P2 2 1 9\n7\n10", "x:3: no value, expected 0 to 9");
  refused("P2 2 1 9 7 -1", "no value");
  refused("P2 2 1 9 7 x", "no value");
  refused("P2 2 1 9 7\n999999999999 ", "x:2: no value");
  refused("P2 2 1 9 7\n\n4x ", "x:3: no value");
  refused("P2 2 1 9 7 7 7", "goes on after the last value");
  refused("P2 30000 30000 255 1", "too few bytes for 900000000 values");
  refused("P6 30000 30000 255 ", "byte 19: 0 bytes of values, expected 2700000000");
  refused("P5 2 1 255\na", "1 bytes of values, expected 2");
  refused("P5 2 1 255\nabc", "3 bytes of values, expected 2");
  refused("P5 1 1 9\na", "byte 9: value 97, expected at most 9");
  const std::string whole = "P3 2 1 255 11 22 33 44 55 66";
  for (std::size_t n = 0; n + 1 < whole.size(); ++n)
    EXPECT_THROW((void)formats::read_pnm(whole.substr(0, n), "x"), Error) << n;
}

TEST(ImageFile, IsToldByItsFirstBytes) {
  const texture::Image image = noise(8, 8, 3);
  for (const std::string& bytes : {formats::write_png(image), formats::write_ppm(image)}) {
    const ScratchFile file(".dat");
    std::ofstream(file.path(), std::ios::binary) << bytes;
    formats::Input input(file.path());
    EXPECT_EQ(formats::read_image(input, {}), image);
  }
  {
    const ScratchFile file(".dat");
    std::ofstream(file.path()) << "P3 2 1 255 1 0 0  255 255 255 "; // 2126 · 257 / 10000 = 54.6
    formats::Input input(file.path());
    EXPECT_EQ(formats::read_heights(input, {}), (texture::Heights{2, 1, {55, 65535}}));
  }
  const ScratchFile file(".png");
  std::ofstream(file.path()) << "GIF89a";
  formats::Input input(file.path());
  EXPECT_THROW((void)formats::read_image(input, {}), Error);
}

} // namespace
} // namespace gewebe::test
