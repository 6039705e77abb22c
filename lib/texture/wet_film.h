#pragma once
// What a thin film of water on a surface mirrors, or a polished instrument.

namespace gewebe::texture {

/// ((n - 1) / (n + 1))² for the refractive index n = 1.336 of the body's fluids.
inline constexpr double water_reflectance = (0.336 / 2.336) * (0.336 / 2.336);
/// Of steel, about.
inline constexpr double steel_reflectance = 0.56;

/// A pixel of colour c (what the textures compose) gets
///   min(1, c + w (F(n·v) (b - c) + H)),  H = π D(n·h) F(v·h) (n·l) G(n·l) G(n·v) / (4 (n·l) (n·v))
/// for the unit vectors v to the eye, l to the light, h between them, and the normal n on the eye's
/// side. b is the background, the one thing that surrounds the surface. H is the light's mirror
/// image where a white surface that faces the light has 1: microfacets of Walter et al. (Microfacet
/// Models for Refraction through Rough Surfaces, 2007), D = a² / (π ((n·h)² (a² - 1) + 1)²) (GGX)
/// and Smith's G(x) = 2x / (x + √(a² + (1 - a²) x²)), 0 where l or v is behind the surface, with
/// a the roughness squared, and Schlick's F(x) = F0 + (1 - F0) (1 - x)⁵ (An Inexpensive BRDF Model
/// for Physically-based Rendering, 1994). Where a structure has the relief r, n is tilted by its
/// slope towards the light: n + (2 r - 1) t, t the unit vector along the surface towards the light.
struct WetFilm {
  double amount = 0;                      ///< w, 0 (dry) … 1
  double roughness = 0.3;                 ///< 0.1 … 1
  double reflectance = water_reflectance; ///< F0
};

} // namespace gewebe::texture
