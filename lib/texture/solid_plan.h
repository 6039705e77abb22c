#pragma once
// A solid texture in numbers of single precision, for the inner loops of all ways of drawing.

#include <cstdint>

namespace gewebe::texture {

enum class SolidKind : std::uint8_t { noise, veins };

constexpr int solid_octaves = 12;

/// y = rows q + part in cells of octave 0, from the corner `whole` of its lattice on.
struct SolidPlan {
  SolidKind kind = SolidKind::noise;
  bool filtered = true;
  int octaves = 0;
  float rows[3][3] = {};
  float part[3] = {}; ///< 0 … 1
  std::uint32_t whole[3] = {};
  // Of each octave, veins have one more.
  std::uint32_t seed[solid_octaves + 1] = {};
  float shift[solid_octaves + 1][3] = {};
  float gain[solid_octaves + 1] = {};  ///< noise: of n_k in f
  float faded[solid_octaves + 1] = {}; ///< veins: mean_k
  float cells = 0;                     ///< of octave 0 in q's unit
  float roughness = 0, width = 0;
  float ground[3] = {}, span[3] = {}; ///< span = color - ground
};

constexpr float vein_reach = 0.35F;

} // namespace gewebe::texture
