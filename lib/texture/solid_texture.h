#pragma once
// Textures that fill space instead of lying on a surface: gradient noise and veins, at the shape at
// rest. They need no coordinates, have no seams and no edge, and stay on tissue that moves.
//
// Based on: Perlin, Improving Noise, 2002 (fade function, gradients to the edges of a cube);
// Norton, Rockwood and Skolmoski, Clamping, 1982 (octaves fade before they alias); Ebert et al.,
// Texturing and Modeling, 2003 (octaves, ridges). The report's outlook: texturing implicit
// surfaces.

#include "geometry/vec3.h"
#include "texture/solid_plan.h"

#include <cstdint>
#include <optional>
#include <string_view>

namespace gewebe::texture {

/// With p in mm at rest, y = Q p / scale in cells, where Q is the rotation of the quaternion
/// (5; 2, 3, 1) / sqrt(39), so that no plane of a body coincides with one of the lattice:
///
/// n_k(y) is the gradient noise of octave k at x = 2^k y + d_k, d_k the fractional parts of
/// k (0.7548776662, 0.5698402910, 0.3247179572): the sum over the corners i of x's cell of
/// fade(1 - |x - i|) · (gradient(i) · (x - i)), fade(t) = 6 t^5 - 15 t^4 + 10 t^3 along each axis.
/// Corners count modulo 2^32. With scramble(h) = { h ^= h >> 16; h *= 0x7feb352d; h ^= h >> 15; h
/// *= 0x846ca68b; h ^= h >> 16 } a corner has h = scramble(0x8da6b343 i_x ^ 0xd8163841 i_y ^
/// 0xcb1ab31f i_z ^ seed_k), seed_k = scramble(seed + 0x9e3779b9 k). Its gradient lacks x where h
/// as a signed number is below -2^32/6, z where it is above 2^32/6, else y; bit 0 is the sign of
/// its first, bit 1 of its second part.
///
/// Octaves fade under the footprint u, the length in mm at rest that a pixel covers in the longer
/// one of its two directions: a_k = clamp(1.5 - 2 u_k, 0, 1), u_k = 2^k u / scale; a_k = 1 without
/// `filtered`.
///
/// noise: f = clamp(1/2 + contrast sum_k a_k g^k n_k / sqrt(sum_k g^2k), 0, 1), g the roughness;
/// n_k has the standard deviation 0.27.
///
/// veins: level k lies where m_k = n_k + g a_{k+1} n_{k+1} is 0, line_k = (w / W) max(0, 1 - (m_k /
/// W)²)², W² = w² + u_k² (thinner ones than a pixel are paler instead), and only near those of the
/// level before, from which they branch: reach_0 = 1, reach_{k+1} = reach_k max(0, 1 - (m_k /
/// 0.35)²). f = 1 - prod_k (1 - a_k reach_k line_k - (1 - a_k) mean_k), mean_k the
/// mean of what fades, 1.52 w (1 + g²)^-1/2 (0.58 - 0.09 g²)^k (fitted, within 2 %).
///
/// The colour is ground + f (color - ground); f itself is the height of a structure.
struct SolidTexture {
  SolidKind kind = SolidKind::noise;
  std::optional<double> scale; ///< edge of a cell of octave 0, mm; nothing: by the surface
  int octaves = 4;             ///< 1 … solid_octaves
  std::uint32_t seed = 1;
  double roughness = 0.5; ///< g, 0 … 1
  double contrast = 0.6;  ///< of noise
  double width = 0.06;    ///< w of veins: about the share of a cell that the widest take, 0 … 1
  bool filtered = true;
  Vec3 ground, color{1, 1, 1}; ///< 0 … 1
};

/// "noise", "veins", or either with ":key=value,...": scale, octaves, seed, roughness,
/// ground=R/G/B, color=R/G/B, contrast of noise, width of veins. Veins are dark on white by
/// default. \throw Error if a key or value is wrong
SolidTexture solid_texture_from_text(std::string_view text);
/// Whether a text names a solid texture rather than a file.
bool is_solid_texture(std::string_view text);

/// For places q = (p - origin) / unit. \pre scale is set; unit > 0
SolidPlan solid_plan(const SolidTexture& texture, const Vec3& origin, double unit);

} // namespace gewebe::texture
