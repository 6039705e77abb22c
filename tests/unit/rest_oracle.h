#pragma once
// Textures on the shape at rest by their formulas (rest.h, solid_texture.h), in double and one
// point at a time; nothing of the library but the plain data that they are asked about.

#include "texture/rest.h"
#include "texture/solid_texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace gewebe::test {

inline std::uint32_t scramble(std::uint32_t h) {
  h = (h ^ (h >> 16)) * 0x7feb352dU;
  h = (h ^ (h >> 15)) * 0x846ca68bU;
  return h ^ (h >> 16);
}

/// n_k at y cells.
inline double noise_oracle(const Vec3& y, int k, std::uint32_t seed) {
  const double golden[3] = {0.7548776662, 0.5698402910, 0.3247179572};
  const std::uint32_t seed_k = scramble(seed + 0x9e3779b9U * static_cast<std::uint32_t>(k));
  Vec3 x;
  for (int a = 0; a < 3; ++a)
    x[a] = y[a] * std::pow(2.0, k) + std::fmod(k * golden[a], 1.0);
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 d;
    std::uint32_t i[3];
    double weight = 1;
    for (int a = 0; a < 3; ++a) {
      const double at = std::floor(x[a]) + ((corner >> a) & 1);
      d[a] = x[a] - at;
      i[a] = static_cast<std::uint32_t>(static_cast<std::int64_t>(at)); // modulo 2^32
      const double t = 1 - std::fabs(d[a]);
      weight *= t * t * t * (t * (6 * t - 15) + 10);
    }
    const std::uint32_t h =
        scramble(i[0] * 0x8da6b343U ^ i[1] * 0xd8163841U ^ i[2] * 0xcb1ab31fU ^ seed_k);
    const double word = static_cast<std::int32_t>(h);
    std::array<double, 2> parts{d.x, d.z};
    if (word < -4294967296.0 / 6)
      parts = {d.y, d.z};
    else if (word > 4294967296.0 / 6)
      parts = {d.x, d.y};
    sum +=
        weight * (((h & 1U) != 0 ? -parts[0] : parts[0]) + ((h & 2U) != 0 ? -parts[1] : parts[1]));
  }
  return sum;
}

/// f at p for a footprint, both in mm.
inline double solid_oracle(const texture::SolidTexture& texture, const Vec3& p, double footprint) {
  // p turned by the quaternion w + v: p + 2 w (v × p) + 2 v × (v × p), for one of length 1.
  const double length = std::sqrt(39.0), w = 5 / length;
  const Vec3 v = Vec3{2, 3, 1} / length;
  const Vec3 y = (p + 2 * w * cross(v, p) + 2 * cross(v, cross(v, p))) / texture.scale.value();
  const auto share = [&](int k) {
    const double u = std::pow(2.0, k) * footprint / texture.scale.value();
    return texture.filtered ? std::clamp(1.5 - 2 * u, 0.0, 1.0) : 1.0;
  };
  const double g = texture.roughness;
  if (texture.kind == texture::SolidKind::noise) {
    double sum = 0, squares = 0;
    for (int k = 0; k < texture.octaves; ++k) {
      sum += share(k) * std::pow(g, k) * noise_oracle(y, k, texture.seed);
      squares += std::pow(g, 2 * k);
    }
    return std::clamp(0.5 + texture.contrast * sum / std::sqrt(squares), 0.0, 1.0);
  }
  double clear = 1, reach = 1;
  for (int k = 0; k < texture.octaves; ++k) {
    const double m =
        noise_oracle(y, k, texture.seed) + g * share(k + 1) * noise_oracle(y, k + 1, texture.seed);
    const double u = texture.filtered ? std::pow(2.0, k) * footprint / texture.scale.value() : 0;
    const double wide = std::hypot(texture.width, u);
    const double bump = std::max(0.0, 1 - m * m / (wide * wide));
    const double line = texture.width / wide * bump * bump;
    const double mean =
        1.52 * texture.width / std::sqrt(1 + g * g) * std::pow(0.58 - 0.09 * g * g, k);
    clear *= 1 - share(k) * reach * line - (1 - share(k)) * mean;
    reach *= std::max(0.0, 1 - (m / 0.35) * (m / 0.35));
  }
  return 1 - clear;
}

/// w_a, their sum 1.
inline std::array<double, 3> triplanar_oracle(const Vec3& n, int sharpness) {
  const double max = std::max({std::fabs(n.x), std::fabs(n.y), std::fabs(n.z)});
  if (!(max > 0))
    return {0, 0, 1};
  std::array<double, 3> w{};
  for (int a = 0; a < 3; ++a)
    w[static_cast<std::size_t>(a)] =
        std::max(0.0, std::pow(std::fabs(n[a]) / max, sharpness) - 1.0 / 256);
  const double sum = w[0] + w[1] + w[2];
  return {w[0] / sum, w[1] / sum, w[2] / sum};
}

} // namespace gewebe::test
