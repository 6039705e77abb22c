#include "formats/page/packing.h"

#include "base/error.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>

namespace gewebe::formats {
namespace {

constexpr double most = 65535;

/// \throw Error
std::string compressed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), 6) != Z_OK)
    throw Error("zlib cannot compress " + std::to_string(bytes.size()) + " bytes");
  result.resize(size);
  return result;
}

std::uint16_t rounded(double value) {
  return static_cast<std::uint16_t>(std::floor(std::clamp(value, 0.0, most) + 0.5));
}

/// 0, -1, 1, -2, … as 0, 1, 2, 3, …
std::uint16_t zigzag(std::uint16_t difference) {
  return static_cast<std::uint16_t>((difference << 1) ^ ((difference & 0x8000) != 0 ? 0xffff : 0));
}
std::uint32_t zigzag(std::uint32_t difference) {
  return (difference << 1) ^ ((difference & 0x80000000U) != 0 ? 0xffffffffU : 0);
}

} // namespace

PlaceGrid place_grid(const Box3& box) {
  if (box.empty())
    return {};
  const double side = box.longest_side();
  return {box.min, side > 0 ? side / most : 1};
}

std::vector<std::uint16_t> quantised(std::span<const Vec3> points, const PlaceGrid& grid) {
  std::vector<std::uint16_t> numbers;
  numbers.reserve(3 * points.size());
  for (const Vec3& p : points)
    for (int axis = 0; axis < 3; ++axis)
      numbers.push_back(rounded((p[axis] - grid.origin[axis]) / grid.step));
  return numbers;
}

std::vector<std::uint16_t> quantised(std::span<const double> values, double least,
                                     double greatest) {
  const double span = greatest > least ? greatest - least : 1;
  std::vector<std::uint16_t> numbers;
  numbers.reserve(values.size());
  for (const double value : values)
    numbers.push_back(rounded(std::clamp((value - least) / span, 0.0, 1.0) * (most - 1)));
  return numbers;
}

std::string packed_rows(std::span<const std::vector<std::uint16_t>> rows, std::size_t axes) {
  const std::size_t length = rows.empty() ? 0 : rows.front().size(), all = rows.size() * length;
  std::string planes(2 * all, '\0');
  const std::vector<std::uint16_t> zeros(length);
  std::size_t at = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const std::vector<std::uint16_t>&now = rows[r], &before = r == 0 ? zeros : rows[r - 1];
    for (std::size_t axis = 0; axis < axes; ++axis) {
      std::uint16_t last = 0;
      for (std::size_t i = axis; i < length; i += axes, ++at) {
        const auto change = static_cast<std::uint16_t>(now[i] - before[i]);
        const std::uint16_t code = zigzag(static_cast<std::uint16_t>(change - last));
        planes[at] = static_cast<char>(code & 0xff);
        planes[all + at] = static_cast<char>(code >> 8);
        last = change;
      }
    }
  }
  return base64(compressed(planes));
}

std::string packed_corners(std::span<const Triangle> triangles) {
  const std::size_t all = 3 * triangles.size();
  std::string planes(4 * all, '\0');
  std::uint32_t last = 0;
  std::size_t at = 0;
  for (const Triangle& triangle : triangles)
    for (const std::uint32_t corner : triangle) {
      const std::uint32_t code = zigzag(corner - last);
      for (std::size_t plane = 0; plane < 4; ++plane)
        planes[plane * all + at] = static_cast<char>(code >> (8 * plane) & 0xff);
      last = corner;
      ++at;
    }
  return base64(compressed(planes));
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const auto byte = [&](std::size_t k) {
      return at + k < bytes.size() ? std::uint32_t{static_cast<unsigned char>(bytes[at + k])} : 0U;
    };
    const std::uint32_t three = byte(0) << 16 | byte(1) << 8 | byte(2);
    const std::size_t left = bytes.size() - at;
    text += digits[three >> 18];
    text += digits[three >> 12 & 63];
    text += left > 1 ? digits[three >> 6 & 63] : '=';
    text += left > 2 ? digits[three & 63] : '=';
  }
  return text;
}

} // namespace gewebe::formats
