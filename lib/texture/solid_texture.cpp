#include "texture/solid_texture.h"

#include "base/error.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <vector>

namespace gewebe::texture {
namespace {

std::vector<std::string_view> split(std::string_view text, char at) {
  std::vector<std::string_view> parts;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t end = std::min(text.find(at, from), text.size());
    parts.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  return parts;
}

/// \throw Error unless it is a number from `min` to `max`
double number(std::string_view key, std::string_view word, double min, double max,
              const char* expected) {
  double value = 0;
  const auto [rest, status] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (status != std::errc{} || rest != word.data() + word.size() || !(value >= min && value <= max))
    throw Error(std::string(key) + "='" + std::string(word) + "', expected " + expected);
  return value;
}

std::uint32_t whole_number(std::string_view key, std::string_view word, double max,
                           const char* expected, double min = 0) {
  const double value = number(key, word, min, max, expected);
  if (value != std::floor(value))
    throw Error(std::string(key) + "='" + std::string(word) + "', expected " + expected);
  return static_cast<std::uint32_t>(value);
}

Vec3 color(std::string_view key, std::string_view word) {
  constexpr const char* expected = "R/G/B, each from 0 to 1";
  const std::vector<std::string_view> parts = split(word, '/');
  if (parts.size() != 3)
    throw Error(std::string(key) + "='" + std::string(word) + "', expected " + expected);
  return {number(key, parts[0], 0, 1, expected), number(key, parts[1], 0, 1, expected),
          number(key, parts[2], 0, 1, expected)};
}

void set(SolidTexture& texture, std::string_view key, std::string_view word) {
  const bool noise = texture.kind == SolidKind::noise;
  if (key == "scale")
    texture.scale = number(key, word, 1e-6, 1e6, "a length in mm from 1e-6 to 1e6");
  else if (key == "octaves")
    texture.octaves =
        static_cast<int>(whole_number(key, word, solid_octaves, "a whole number from 1 to 12", 1));
  else if (key == "seed")
    texture.seed = whole_number(key, word, 4294967295.0, "a whole number from 0 to 4294967295");
  else if (key == "roughness")
    texture.roughness = number(key, word, 0, 1, "0 to 1");
  else if (key == "contrast" && noise)
    texture.contrast = number(key, word, 0, 100, "0 to 100");
  else if (key == "width" && !noise)
    texture.width = number(key, word, 1e-3, 1, "0.001 to 1");
  else if (key == "ground")
    texture.ground = color(key, word);
  else if (key == "color")
    texture.color = color(key, word);
  else
    throw Error("'" + std::string(key) + "' is no key of " + (noise ? "noise" : "veins") +
                ", expected scale, octaves, seed, roughness, " + (noise ? "contrast" : "width") +
                ", ground or color");
}

std::string_view name_of(std::string_view text) {
  return text.substr(0, std::min(text.find(':'), text.size()));
}

std::uint32_t scrambled(std::uint32_t h) {
  h ^= h >> 16U;
  h *= 0x7feb352dU;
  h ^= h >> 15U;
  h *= 0x846ca68bU;
  return h ^ h >> 16U;
}

} // namespace

bool is_solid_texture(std::string_view text) {
  return name_of(text) == "noise" || name_of(text) == "veins";
}

SolidTexture solid_texture_from_text(std::string_view text) {
  if (!is_solid_texture(text))
    throw Error("'" + std::string(text) + "' is no solid texture, expected noise or veins");
  SolidTexture texture;
  if (name_of(text) == "veins") {
    texture.kind = SolidKind::veins;
    texture.ground = {1, 1, 1};
    texture.color = {0.45, 0.12, 0.15};
  }
  if (name_of(text).size() == text.size())
    return texture;
  std::vector<std::string_view> seen;
  for (const std::string_view pair : split(text.substr(name_of(text).size() + 1), ',')) {
    const std::size_t mid = pair.find('=');
    if (mid == std::string_view::npos)
      throw Error("'" + std::string(pair) + "', expected key=value");
    const std::string_view key = pair.substr(0, mid);
    if (std::ranges::find(seen, key) != seen.end())
      throw Error(std::string(key) + " given more than once");
    seen.push_back(key);
    set(texture, key, pair.substr(mid + 1));
  }
  return texture;
}

SolidPlan solid_plan(const SolidTexture& texture, const Vec3& origin, double unit) {
  SolidPlan plan;
  const double scale = texture.scale.value();
  plan.kind = texture.kind;
  plan.filtered = texture.filtered;
  plan.octaves = texture.octaves;
  plan.cells = static_cast<float>(unit / scale);
  plan.roughness = static_cast<float>(texture.roughness);
  plan.width = static_cast<float>(texture.width);
  constexpr double w = 5, x = 2, y = 3, z = 1, length = w * w + x * x + y * y + z * z;
  const std::array<Vec3, 3> rotated{
      Vec3{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
      Vec3{2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
      Vec3{2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}};
  for (int a = 0; a < 3; ++a) {
    const Vec3& row = rotated[static_cast<std::size_t>(a)];
    for (int b = 0; b < 3; ++b)
      plan.rows[a][b] = static_cast<float>(row[b] / length * (unit / scale));
    const double at = dot(row, origin) / length / scale;
    const double first = std::floor(at);
    plan.part[a] = static_cast<float>(at - first);
    const double period = 4294967296.0;
    plan.whole[a] = static_cast<std::uint32_t>(first - period * std::floor(first / period));
    plan.ground[a] = static_cast<float>(texture.ground[a]);
    plan.span[a] = static_cast<float>(texture.color[a] - texture.ground[a]);
  }
  double squares = 0;
  for (int k = 0; k < texture.octaves; ++k)
    squares += std::pow(texture.roughness, 2 * k);
  constexpr std::array<double, 3> steps{0.7548776662, 0.5698402910, 0.3247179572};
  for (int k = 0; k <= solid_octaves; ++k) {
    plan.seed[k] = scrambled(texture.seed + 0x9e3779b9U * static_cast<std::uint32_t>(k));
    for (std::size_t a = 0; a < 3; ++a)
      plan.shift[k][a] = static_cast<float>(k * steps[a] - std::floor(k * steps[a]));
    plan.gain[k] =
        static_cast<float>(texture.contrast * std::pow(texture.roughness, k) / std::sqrt(squares));
    const double square = texture.roughness * texture.roughness;
    plan.faded[k] = static_cast<float>(1.52 * texture.width / std::sqrt(1 + square) *
                                       std::pow(0.58 - 0.09 * square, k));
  }
  return plan;
}

} // namespace gewebe::texture
