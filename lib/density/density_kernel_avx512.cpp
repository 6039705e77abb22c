#include "density/density_add_internal.h"

#include <immintrin.h>

namespace gewebe::density {
namespace {

// Of the intrinsics, those that put 0 where a bit of the mask isn't set: in GCC 12 the plain ones
// are made of variables without a value, and warned of.
constexpr __mmask16 all = 0xffff;

__m512 twice(__m256 v) {
  return _mm512_maskz_broadcast_f32x8(all, v);
}

__m512 pick(__m512i lanes, __m512 v) {
  return _mm512_maskz_permutexvar_ps(all, lanes, v);
}

/// Two of four numbers at `rest`, for the rows of one register.
struct Rests {
  explicit Rests(const float* rest) : four(_mm512_maskz_broadcast_f32x4(all, _mm_load_ps(rest))) {}
  __m512 first() const {
    return pick(_mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1), four);
  }
  __m512 second() const {
    return pick(_mm512_setr_epi32(2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3), four);
  }
  __m512 four;
};

struct TwoRows {
  static __m512 added(__m512 sum, __m512 rest, const Rows& rows) {
    const __m512 u = _mm512_maskz_max_ps(all, _mm512_sub_ps(rest, twice(_mm256_load_ps(rows.z2))),
                                         _mm512_setzero_ps());
    const __m512 factor =
        _mm512_fmadd_ps(_mm512_set1_ps(rows.cubic), u, _mm512_set1_ps(rows.square));
    return _mm512_fmadd_ps(_mm512_mul_ps(u, u), factor, sum);
  }

  static std::size_t list(const LeafParticle* particles, std::size_t count, Chunk& c) {
    __m512i numbers =
        _mm512_setr_epi32(0, 16, 32, 48, 64, 80, 96, 112, 128, 144, 160, 176, 192, 208, 224, 240);
    Item* items = c.items;
    for (std::size_t n = 0; n < count; ++n) {
      const LeafParticle& p = particles[n];
      Rows& rows = c.rows[n];
      const Squares of = set_rows(p, rows);
      const __m512 rest_x = _mm512_castps256_ps512(of.rest_x), y2_twice = twice(of.y2);
      for (int i = 0; i < 8; i += 2) {
        const __m512i lanes = _mm512_setr_epi32(i, i, i, i, i, i, i, i, i + 1, i + 1, i + 1, i + 1,
                                                i + 1, i + 1, i + 1, i + 1);
        _mm512_store_ps(rows.rest + std::ptrdiff_t{8} * i,
                        _mm512_sub_ps(pick(lanes, rest_x), y2_twice));
      }
      // A half slice is in reach where its nearest row is.
      const __m512 rest = _mm512_sub_ps(
          pick(_mm512_setr_epi32(0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7), rest_x),
          pick(_mm512_setr_epi32(0, 4, 0, 4, 0, 4, 0, 4, 0, 4, 0, 4, 0, 4, 0, 4),
               _mm512_castps256_ps512(of.nearest)));
      const __mmask16 reached =
          _mm512_cmp_ps_mask(rest, _mm512_set1_ps(least_square(p)), _CMP_GT_OQ);
      _mm512_storeu_si512(items, _mm512_maskz_compress_epi32(reached, numbers));
      items += __builtin_popcount(reached);
      numbers = _mm512_add_epi32(numbers, _mm512_set1_epi32(sizeof(Rows)));
    }
    return static_cast<std::size_t>(items - c.items);
  }

  static void add(const Rows& rows, const float* rest, float* values) {
    const Rests rests(rest);
    _mm512_storeu_ps(values, added(_mm512_loadu_ps(values), rests.first(), rows));
    _mm512_storeu_ps(values + 16, added(_mm512_loadu_ps(values + 16), rests.second(), rows));
  }

  static void add_slice(const Rows* rows, std::size_t count, std::size_t slice, float* values) {
    __m512 a = _mm512_loadu_ps(values), b = _mm512_loadu_ps(values + 16),
           c = _mm512_loadu_ps(values + 32), d = _mm512_loadu_ps(values + 48);
    for (std::size_t n = 0; n < count; ++n) {
      const Rests low(rows[n].rest + slice * 8), high(rows[n].rest + slice * 8 + 4);
      a = added(a, low.first(), rows[n]);
      b = added(b, low.second(), rows[n]);
      c = added(c, high.first(), rows[n]);
      d = added(d, high.second(), rows[n]);
    }
    _mm512_storeu_ps(values, a);
    _mm512_storeu_ps(values + 16, b);
    _mm512_storeu_ps(values + 32, c);
    _mm512_storeu_ps(values + 48, d);
  }
};

} // namespace

void add_density_avx512(const LeafParticle* particles, std::size_t count, float* values) {
  add_density<TwoRows>(particles, count, values);
}

} // namespace gewebe::density
