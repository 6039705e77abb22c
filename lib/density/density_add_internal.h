#pragma once
// The density's inner loop, over a level's vectors (`Lanes`); density_kernel_avx2.cpp and
// density_kernel_avx512.cpp compile it. Particles of small support reach few of a leaf's half
// slices of four rows: what is to be done is listed first, without a branch, and then done in one
// loop.

#include "density/density_kernel_internal.h"

#include <immintrin.h>

namespace gewebe::density {
namespace {

inline constexpr std::size_t chunk = 32; ///< particles whose rows fit in the first-level cache
inline constexpr std::size_t half_slices = 16; ///< of a leaf; 2i + h has the rows 4h … 4h + 3 of i

/// What a leaf's rows need of a particle. With rest(i,j) = 1 − sx² − sy² a voxel has
/// u = rest − sz².
struct alignas(512) Rows {
  float rest[64];
  float z2[8];
  float cubic, square;
};

/// Particle n and a half slice as the offset of its rests: 512 n + 16 half slice.
using Item = std::uint32_t;
static_assert(sizeof(Rows) == 512);

struct Chunk {
  Rows rows[chunk];
  /// The half slices that each particle reaches, particle by particle. They are written eight or
  /// sixteen at once, beyond those that count.
  Item items[(chunk + 1) * half_slices];
};

inline __m256 scaled_square(float center, __m256 inverse) {
  const __m256 ramp = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7);
  const __m256 s = _mm256_mul_ps(_mm256_sub_ps(ramp, _mm256_set1_ps(center)), inverse);
  return _mm256_mul_ps(s, s);
}

/// Squares for a particle along the axes: 1 − sx², sy², and in each lane the least of its four sy².
struct Squares {
  __m256 rest_x, y2, nearest;
};

/// Sets all but the rests.
inline Squares set_rows(const LeafParticle& p, Rows& rows) {
  rows.cubic = p.weight * (4.0F / 9);
  rows.square = p.weight * (5.0F / 9);
  const __m256 inverse = _mm256_set1_ps(p.inverse_radius);
  _mm256_store_ps(rows.z2, scaled_square(p.z, inverse));
  const __m256 y2 = scaled_square(p.y, inverse);
  const __m256 pairs = _mm256_min_ps(y2, _mm256_permute_ps(y2, 0b10110001));
  return {_mm256_sub_ps(_mm256_set1_ps(1), scaled_square(p.x, inverse)), y2,
          _mm256_min_ps(pairs, _mm256_permute_ps(pairs, 0b01001110))};
}

/// The least of sz², or less: that of the row's nearest point.
inline float least_square(const LeafParticle& p) {
  const float before = 0 - p.z, behind = p.z - 7;
  const float outside = before > behind ? before : behind;
  const float distance = outside > 0 ? outside : 0;
  const float s = distance * p.inverse_radius;
  return s * s;
}

/// Lanes::list fills in the rests and squares of some particles, lists their items and returns the
/// number of these. u² (4w/9 u + 5w/9) is added to the four rows of an item by Lanes::add, and to
/// the eight of a slice, for some particles that all reach it, by Lanes::add_slice.
template <class Lanes>
void add_density(const LeafParticle* particles, std::size_t count, float* values) {
  Chunk c;
  for (std::size_t begin = 0; begin < count; begin += chunk) {
    const std::size_t some = count - begin < chunk ? count - begin : chunk;
    const std::size_t items = Lanes::list(particles + begin, some, c);
    if (items == some * half_slices) {
      for (std::size_t slice = 0; slice < 8; ++slice)
        Lanes::add_slice(c.rows, some, slice, values + slice * 64);
      continue;
    }
    const char* const rows = reinterpret_cast<const char*>(c.rows);
    char* const sums = reinterpret_cast<char*>(values);
    for (std::size_t m = 0; m < items; ++m) {
      const Item item = c.items[m];
      Lanes::add(*reinterpret_cast<const Rows*>(rows + (item & ~Item{255})),
                 reinterpret_cast<const float*>(rows + item),
                 reinterpret_cast<float*>(sums + std::size_t{8} * (item & 255)));
    }
  }
}

} // namespace
} // namespace gewebe::density
