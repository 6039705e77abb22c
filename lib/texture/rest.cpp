#include "texture/rest.h"

#include <algorithm>
#include <cmath>

namespace gewebe::texture {
namespace {

/// v rotated about the unit axis n by an angle of this cosine and sine (Rodrigues).
Vec3 rotated(const Vec3& v, const Vec3& n, double cosine, double sine) {
  return v * cosine + cross(n, v) * sine + n * (dot(n, v) * (1 - cosine));
}

/// The least rotation that takes one unit vector to another.
class Tilt {
public:
  Tilt(const Vec3& from, const Vec3& to) : cosine_(dot(from, to)) {
    const Vec3 across = cross(from, to);
    sine_ = norm(across);
    if (sine_ > 1e-12) {
      axis_ = across / sine_;
      return;
    }
    // The same, or opposite: then half a turn about any axis across.
    sine_ = 0;
    const int smallest = std::fabs(from.x) < 0.6 ? 0 : 1;
    Vec3 other;
    other[smallest] = 1;
    axis_ = cross(from, other);
    axis_ = axis_ / norm(axis_);
  }
  Vec3 operator()(const Vec3& v) const { return rotated(v, axis_, cosine_, sine_); }

private:
  double cosine_, sine_;
  Vec3 axis_;
};

std::array<float, 3> in_floats(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

} // namespace

RestMapping rest_mapping(const Box3& rest_box, std::optional<double> edge) {
  RestMapping mapping;
  if (rest_box.empty())
    return mapping;
  const double half = rest_box.longest_side() / 2;
  mapping.edge = edge.value_or(half > 0 ? half : 1);
  for (int a = 0; a < 3; ++a)
    mapping.start[a] = std::floor(rest_box.min[a] / mapping.edge) * mapping.edge;
  return mapping;
}

std::vector<DrawTurn> rest_turns(std::span<const Vec3> rest, std::span<const Vec3> rest_normals,
                                 std::span<const Vec3> now, std::span<const Vec3> normals,
                                 std::span<const Triangle> triangles) {
  const std::size_t count = rest.size();
  std::vector<DrawTurn> turns(count);
  const auto has_normals = [&](std::size_t p) {
    return norm(rest_normals[p]) > 0 && norm(normals[p]) > 0;
  };
  std::vector<std::array<double, 2>> sums(count); // of the edges' cosines and sines
  for (const Triangle& t : triangles)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t p = t[c];
      if (!has_normals(p))
        continue;
      const Tilt tilt(rest_normals[p], normals[p]);
      for (const std::size_t other : {(c + 1) % 3, (c + 2) % 3}) {
        const Vec3 from = tilt(rest[t[other]] - rest[p]), to = now[t[other]] - now[p];
        const Vec3& n = normals[p];
        sums[p][0] += dot(from, to) - dot(from, n) * dot(to, n);
        sums[p][1] += dot(n, cross(from, to));
      }
    }
  for (std::size_t p = 0; p < count; ++p) {
    const double length = std::hypot(sums[p][0], sums[p][1]);
    if (!has_normals(p) || !(length > 0) || !std::isfinite(length))
      continue;
    const Tilt tilt(rest_normals[p], normals[p]);
    const auto axis = [&](const Vec3& v) {
      return in_floats(rotated(tilt(v), normals[p], sums[p][0] / length, sums[p][1] / length));
    };
    turns[p] = {axis({1, 0, 0}), axis({0, 1, 0})};
  }
  return turns;
}

} // namespace gewebe::texture
