#include "geometry/affine.h"

#include "base/error.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace gewebe {
namespace {

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t at = 0;;) {
    at = text.find_first_not_of(" \t\r\n,", at);
    if (at == std::string_view::npos)
      return words;
    const std::size_t end = std::min(text.find_first_of(" \t\r\n,", at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
}

double number_of(std::string_view word) {
  std::string_view digits = word;
  if (digits.starts_with('+'))
    digits.remove_prefix(1);
  double value = 0;
  const auto [end, status] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (status != std::errc{} || end != digits.data() + digits.size() || !std::isfinite(value))
    throw Error("'" + std::string(word) + "' is no number");
  return value;
}

std::size_t axis_of(std::string_view word) {
  if (word == "x" || word == "y" || word == "z")
    return static_cast<std::size_t>(word[0] - 'x');
  throw Error("'" + std::string(word) + "' is no axis, expected x, y or z");
}

Affine rotation(std::size_t axis, double degrees) {
  // By series over an eighth of a turn: libraries differ in the last digit.
  const double turn = std::remainder(degrees, 360.0), quarters = std::nearbyint(turn / 90);
  const double x = (turn - 90 * quarters) * std::numbers::pi / 180;
  double c = 1, s = x, even = 1, odd = x;
  for (int n = 1; n < 12; ++n) {
    const double twice = 2 * n;
    even *= -x * x / ((twice - 1) * twice);
    odd *= -x * x / (twice * (twice + 1));
    c += even;
    s += odd;
  }
  for (int q = static_cast<int>(quarters < 0 ? quarters + 4 : quarters); q > 0; --q) {
    const double before = c; // a quarter more
    c = 0 - s;
    s = before;
  }
  const std::size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
  Affine map;
  map.m[4 * a + a] = c;
  map.m[4 * a + b] = 0 - s; // no -0
  map.m[4 * b + a] = s;
  map.m[4 * b + b] = c;
  return map;
}

Affine step_of(const std::vector<std::string_view>& words) {
  const std::string_view word = words[0];
  const auto need = [&](bool right, const char* form) {
    if (!right)
      throw Error("'" + std::string(word) + "' of " + std::to_string(words.size() - 1) +
                  " words, expected " + form);
  };
  Affine map;
  if (word == "translate") {
    need(words.size() == 4, "translate X Y Z");
    for (std::size_t i = 0; i < 3; ++i)
      map.m[4 * i + 3] = number_of(words[i + 1]);
  } else if (word == "rotate") {
    need(words.size() == 3, "rotate x|y|z DEGREES");
    map = rotation(axis_of(words[1]), number_of(words[2]));
  } else if (word == "scale") {
    need(words.size() == 2 || words.size() == 4, "scale S or scale X Y Z");
    for (std::size_t i = 0; i < 3; ++i) {
      map.m[5 * i] = number_of(words[words.size() == 2 ? 1 : i + 1]);
      if (map.m[5 * i] == 0)
        throw Error("scale by 0, expected another number");
    }
  } else if (word == "mirror") {
    need(words.size() == 2, "mirror x|y|z");
    map.m[5 * axis_of(words[1])] = -1;
  } else {
    throw Error("'" + std::string(word) +
                "' is no transform, expected translate, rotate, scale or mirror");
  }
  return map;
}

} // namespace

Vec3 Affine::operator()(const Vec3& p) const {
  return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
          m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
}

double Affine::determinant() const {
  return dot(Vec3{m[0], m[1], m[2]}, cross(Vec3{m[4], m[5], m[6]}, Vec3{m[8], m[9], m[10]}));
}

bool Affine::is_rigid() const {
  const std::array<Vec3, 3> rows{Vec3{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j <= i; ++j)
      if (!(std::fabs(dot(rows[i], rows[j]) - (i == j ? 1 : 0)) <= 1e-9))
        return false;
  return true;
}

Affine operator*(const Affine& then, const Affine& first) {
  Affine product;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      double sum = j == 3 ? then.m[4 * i + 3] : 0;
      for (std::size_t k = 0; k < 3; ++k)
        sum += then.m[4 * i + k] * first.m[4 * k + j];
      product.m[4 * i + j] = sum;
    }
  return product;
}

Affine parse_affine(std::string_view text) {
  Affine map;
  bool any = false;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(';', begin), text.size());
    if (const auto words = words_of(text.substr(begin, end - begin)); !words.empty()) {
      map = step_of(words) * map;
      any = true;
    }
    begin = end + 1;
  }
  if (!any)
    throw Error("no transform, expected translate, rotate, scale or mirror");
  return map;
}

Affine parse_affine_matrix(std::string_view text) {
  std::string plain;
  bool comment = false;
  for (const char c : text) {
    comment = c == '#' || (comment && c != '\n');
    plain += comment ? ' ' : c;
  }
  const auto words = words_of(plain);
  if (words.size() != 16)
    throw Error(std::to_string(words.size()) + " numbers, expected the 16 of a 4 x 4 matrix");
  Affine map;
  for (std::size_t n = 0; n < 16; ++n) {
    const double value = number_of(words[n]);
    if (n < 12)
      map.m[n] = value;
    else if (value != (n == 15 ? 1 : 0))
      throw Error("the last row is not 0 0 0 1, expected an affine matrix");
  }
  double size = 1;
  for (std::size_t i = 0; i < 3; ++i)
    size *= norm(Vec3{map.m[4 * i], map.m[4 * i + 1], map.m[4 * i + 2]});
  if (!(std::fabs(map.determinant()) > 1e-12 * size))
    throw Error("the matrix is singular, expected one that can be inverted");
  return map;
}

} // namespace gewebe
