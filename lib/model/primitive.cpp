#include "model/primitive.h"

#include "base/error.h"

#include <charconv>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace gewebe::model {

namespace {

constexpr double max_nodes = 1e8;

/// Cosine and sine of k/m of a turn. By their series over an eighth of it: libraries differ in the
/// last digit. \pre k <= m
std::pair<double, double> turn(std::uint64_t k, std::uint64_t m) {
  const std::uint64_t eighth = 8 * k / m;
  const bool back = eighth % 2 == 1; // mirrored at the next multiple of an eighth
  const std::uint64_t rest = back ? (eighth + 1) * m - 8 * k : 8 * k - eighth * m;
  const double x = std::numbers::pi / 4 * (static_cast<double>(rest) / static_cast<double>(m));
  double c = 0, s = 0, term = 1;
  for (int p = 0; p < 24; ++p) { // the last one is below 1e-25
    (p % 2 == 0 ? c : s) += p / 2 % 2 == 0 ? term : -term;
    term *= x / (p + 1);
  }
  if (back)
    std::swap(c, s); // a quarter minus x
  switch (eighth / 2 % 4) {
  case 1:
    return {-s, c};
  case 2:
    return {-c, -s};
  case 3:
    return {s, -c};
  default:
    return {c, s};
  }
}

void quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

double positive(std::string_view text) {
  double value = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc{} || end != text.data() + text.size() || !(value > 0) ||
      !std::isfinite(value))
    throw Error("'" + std::string(text) + "' is no length, expected a number above 0");
  return value;
}

} // namespace

Primitive parse_primitive(std::string_view text, std::string_view size) {
  Primitive p;
  const std::size_t colon = text.find(':'), by = text.find('x', colon + 1);
  const std::string_view name = text.substr(0, colon);
  const auto wrong = [&]() {
    return Error("no primitive '" + std::string(text) +
                 "', expected plane, tube or sphere and MxN");
  };
  if (colon == std::string_view::npos || by == std::string_view::npos)
    throw wrong();
  std::uint32_t min_m = 3, min_n = 2;
  if (name == "plane")
    min_m = 2;
  else if (name == "tube")
    p = {PrimitiveShape::tube, 3, 2, 20, 100};
  else if (name == "sphere") {
    p = {PrimitiveShape::sphere, 3, 1, 50, 50};
    min_n = 1;
  } else
    throw wrong();
  const auto count = [&](std::string_view word, std::uint32_t min) {
    std::uint32_t value = 0;
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (status != std::errc{} || end != word.data() + word.size())
      throw wrong();
    if (value < min)
      throw Error("a " + std::string(name) + " of " + std::string(text.substr(colon + 1)) +
                  " nodes, expected " + std::to_string(min_m) + "x" + std::to_string(min_n) +
                  " or more");
    return value;
  };
  p.m = count(text.substr(colon + 1, by - colon - 1), min_m);
  p.n = count(text.substr(by + 1), min_n);
  if (static_cast<double>(p.m) * p.n > max_nodes)
    throw Error("over 1e8 nodes, expected fewer");
  if (!size.empty()) {
    const std::size_t comma = size.find(',');
    p.a = positive(size.substr(0, comma));
    if (comma != std::string_view::npos) {
      if (p.shape == PrimitiveShape::sphere)
        throw Error("two lengths for a sphere, expected its radius");
      p.b = positive(size.substr(comma + 1));
    } else if (p.shape == PrimitiveShape::plane) {
      p.b = p.a;
    }
  }
  return p;
}

TriangleMesh primitive_mesh(const Primitive& p) {
  TriangleMesh mesh;
  const bool closed = p.shape != PrimitiveShape::plane;
  mesh.points.reserve(std::size_t{p.m} * p.n + 2);
  for (std::uint32_t j = 0; j < p.n; ++j)
    for (std::uint32_t i = 0; i < p.m; ++i) {
      const auto [c, s] = turn(i, p.m);
      if (p.shape == PrimitiveShape::plane) {
        mesh.points.push_back({p.a * i / (p.m - 1), p.b * j / (p.n - 1), 0});
      } else if (p.shape == PrimitiveShape::tube) {
        mesh.points.push_back({p.a * c, p.a * s, p.b * j / (p.n - 1)});
      } else {
        const auto [up, out] = turn(j + std::uint64_t{1}, 2 * (p.n + std::uint64_t{1}));
        mesh.points.push_back({p.a * out * c, p.a * out * s, -p.a * up});
      }
    }
  const auto at = [&](std::uint32_t i, std::uint32_t j) { return j * p.m + i % p.m; };
  for (std::uint32_t j = 0; j + 1 < p.n; ++j)
    for (std::uint32_t i = 0; i + (closed ? 0U : 1U) < p.m; ++i)
      quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  if (p.shape != PrimitiveShape::sphere)
    return mesh;
  const auto south = static_cast<std::uint32_t>(mesh.points.size());
  mesh.points.push_back({0, 0, -p.a});
  mesh.points.push_back({0, 0, p.a});
  for (std::uint32_t i = 0; i < p.m; ++i) {
    mesh.triangles.push_back({south, at(i + 1, 0), at(i, 0)});
    mesh.triangles.push_back({south + 1, at(i, p.n - 1), at(i + 1, p.n - 1)});
  }
  return mesh;
}

} // namespace gewebe::model
