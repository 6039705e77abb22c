#pragma once
// How a surface looks: its textures and colours, and the formula that joins them. Report 3.2.

#include "geometry/vec3.h"
#include "texture/rest.h"
#include "texture/solid_texture.h"
#include "texture/texture.h"
#include "texture/wet_film.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace gewebe::texture {

/// Absent textures are neither read nor computed with: without base the colour alone, without
/// structure r = 0.5, which leaves the base as it is.
struct SurfaceMaterial {
  std::optional<Texture> base;
  std::optional<Texture> detail;     ///< added to the base
  std::optional<Texture> reflection; ///< added to both; of what surrounds the surface
  std::optional<Texture> structure;  ///< the height f, one channel
  std::optional<SolidTexture> solid_base, solid_detail, solid_structure; ///< instead of images
  RestMapping rest;         ///< of textures on the shape at rest
  WetFilm film;             ///< upon it all
  Vec3 color{1, 1, 1};      ///< factor of the base, 0 … 1
  Vec3 background{1, 1, 1}; ///< 0 … 1
  std::vector<SurfaceMaterial>
      others; ///< of groups 1, 2, … of a drawing; their backgrounds don't count
};

/// \pre group <= material.others.size()
inline const SurfaceMaterial& material_of_group(const SurfaceMaterial& material,
                                                std::size_t group) {
  return group == 0 ? material : material.others[group - 1];
}

/// Whether an image lies on the surface by three projections.
inline bool is_triplanar(const SurfaceMaterial& material, const std::optional<Texture>& image) {
  return material.rest.triplanar && image && !image->options.sphere;
}
/// Whether some texture is one of the shape at rest, which the fixed functions can't draw.
inline bool is_at_rest(const SurfaceMaterial& material) {
  return material.solid_base || material.solid_detail || material.solid_structure ||
         is_triplanar(material, material.base) || is_triplanar(material, material.detail) ||
         is_triplanar(material, material.reflection) || is_triplanar(material, material.structure);
}

/// Completes `material.rest`, and scales of solid textures that are left open: a quarter of its
/// edge. So for all groups.
inline void place_at_rest(SurfaceMaterial& material, const Box3& rest_box,
                          std::optional<double> edge) {
  const RestMapping mapping = rest_mapping(rest_box, edge);
  material.rest.start = mapping.start;
  material.rest.edge = mapping.edge;
  for (auto* solid : {&material.solid_base, &material.solid_detail, &material.solid_structure})
    if (*solid && !(*solid)->scale)
      (*solid)->scale = mapping.edge / 4;
  for (SurfaceMaterial& other : material.others)
    place_at_rest(other, rest_box, edge);
}

/// s of the composition: makes up for r being 0.5 where the structure is flat.
constexpr double emboss_scale = 2;

/// r = 0.5 + 0.5 (f(s, t) - f(s + ds, t + dt)) (report 3.2.3).
inline double relief(double height, double height_to_light) {
  return 0.5 + 0.5 * (height - height_to_light);
}

/// min(1, s r min(1, min(1, base + detail) + reflection)) on stored values (report 3.2.4 and 4.2).
inline double compose(double base, double detail, double reflection, double r) {
  return std::min(1.0, emboss_scale * r * std::min(1.0, std::min(1.0, base + detail) + reflection));
}

/// A value 0 … 1 as 8 bits, rounded; values outside are clamped.
inline std::uint8_t stored(double value) {
  return static_cast<std::uint8_t>(std::floor(std::clamp(value, 0.0, 1.0) * 255 + 0.5));
}

inline std::array<std::uint8_t, 3> stored(const Vec3& color) {
  return {stored(color.x), stored(color.y), stored(color.z)};
}

} // namespace gewebe::texture
