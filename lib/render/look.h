#pragma once
// How a surface looks: its textures and colours, and the formula that joins them. Report 3.2.

#include "base/vec3.h"
#include "render/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace gewebe {

/// Absent textures are neither read nor computed with: without base the colour alone, without
/// structure r = 0.5, which leaves the base as it is.
struct Look {
  std::optional<Texture> base;
  std::optional<Texture> detail;     ///< added to the base
  std::optional<Texture> reflection; ///< added to both; of what surrounds the surface
  std::optional<Texture> structure;  ///< the height f, one channel
  Vec3 color{1, 1, 1};               ///< factor of the base, 0 … 1
  Vec3 background{1, 1, 1};          ///< 0 … 1
  std::vector<Look> others; ///< of groups 1, 2, … of a drawing; their backgrounds don't count
};

/// \pre group <= look.others.size()
inline const Look& look_of_group(const Look& look, std::size_t group) {
  return group == 0 ? look : look.others[group - 1];
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

} // namespace gewebe
