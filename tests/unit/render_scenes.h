#pragma once
// Textures, surfaces and materials for pictures.

#include "geometry/mesh.h"
#include "render_oracle.h"
#include "texture/image.h"
#include "texture/surface_material.h"
#include "texture/texture.h"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

namespace gewebe::test {

/// A texture of odd sides with soft spots, all channels different.
inline texture::Image spots(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  texture::Image image{width, height, channels, {}};
  std::mt19937 random(7);
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x)
      for (std::uint32_t c = 0; c < channels; ++c) {
        const double wave = std::sin(2 * std::numbers::pi * (3.0 * x / width + 0.3 * c)) *
                            std::cos(2 * std::numbers::pi * (2.0 * y / height + 0.2 * c));
        const double noise = static_cast<double>(random()) / 4294967296.0;
        image.values.push_back(static_cast<std::uint8_t>(128 + 90 * wave + 36 * noise));
      }
  return image;
}

/// A torus with exact coordinates, one quad a patch, part of them mirrored.
inline TriangleMesh torus(std::uint32_t around, std::uint32_t across, bool mirror) {
  TriangleMesh m;
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const double u = 2 * std::numbers::pi * i / around, v = 2 * std::numbers::pi * j / across,
                   r = 20 + 8 * std::cos(v);
      m.points.push_back({r * std::cos(u), r * std::sin(u), 8 * std::sin(v)});
    }
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t j = 0; j < across; ++j) {
      const std::uint32_t i1 = (i + 1) % around, j1 = (j + 1) % across;
      const std::uint32_t a = i * across + j, b = i1 * across + j, c = i1 * across + j1,
                          d = i * across + j1;
      // Mirrored: s runs back in the second half.
      const auto s_at = [&](std::uint32_t k) {
        const double s = 2.0 * k / around;
        return static_cast<float>(mirror && s > 1 ? 2 - s : s);
      };
      const auto t_at = [&](std::uint32_t k) {
        return static_cast<float>(static_cast<double>(k) / across);
      };
      const float s0 = s_at(i), s1 = s_at(i + 1), t0 = t_at(j), t1 = t_at(j + 1);
      m.triangles.push_back({a, b, c});
      m.texcoords.push_back({s0, t0, s1, t0, s1, t1});
      m.triangles.push_back({a, c, d});
      m.texcoords.push_back({s0, t0, s1, t1, s0, t1});
    }
  return m;
}

/// The material that an oracle's scene has, before black unless it has another background.
inline texture::SurfaceMaterial material_of(const OracleScene& scene) {
  texture::SurfaceMaterial material;
  texture::TextureOptions filter;
  filter.filter = scene.mipmap ? texture::TextureFilter::mipmap : texture::TextureFilter::linear;
  if (scene.base)
    material.base = texture::texture_from(*scene.base, filter);
  if (scene.structure)
    material.structure = texture::texture_from(*scene.structure, filter);
  if (scene.heights)
    material.structure = texture::texture_from(*scene.heights, filter);
  if (scene.detail)
    material.detail = texture::texture_from(*scene.detail, filter);
  filter.sphere = true;
  if (scene.reflection)
    material.reflection = texture::texture_from(*scene.reflection, filter);
  material.solid_base = scene.solid_base;
  material.solid_detail = scene.solid_detail;
  material.solid_structure = scene.solid_structure;
  material.rest = scene.rest;
  material.color = scene.color;
  material.film = scene.film;
  material.background = scene.background;
  for (OracleScene other : scene.others) {
    other.rest = scene.rest;
    other.mipmap = scene.mipmap;
    material.others.push_back(material_of(other));
  }
  return material;
}

} // namespace gewebe::test
