#pragma once
// Body of column_sum_*.cpp. Each of these files compiles it for its instruction set.

#include "columns/column_sum.h"
#include "numeric/four_lanes.h"

#include <cstring>
#include <immintrin.h>

namespace gewebe::columns {
namespace {

// Small integers need intrinsics, because compilers widen them one by one.
inline void widen(__m128i whole, numeric::Four& to) { // four of 32 bits
#ifdef __AVX2__
  to = reinterpret_cast<numeric::Four>(_mm256_cvtepi32_pd(whole));
#else
  const __m128d low = _mm_cvtepi32_pd(whole), high = _mm_cvtepi32_pd(_mm_srli_si128(whole, 8));
  std::memcpy(&to, &low, sizeof low);
  std::memcpy(reinterpret_cast<char*>(&to) + sizeof low, &high, sizeof high);
#endif
}
using numeric::load; // of double and float

inline void load(const std::int16_t* at, numeric::Four& to) {
  std::int64_t four = 0;
  std::memcpy(&four, at, sizeof four);
  const __m128i packed = _mm_cvtsi64_si128(four);
#ifdef __AVX2__
  widen(_mm_cvtepi16_epi32(packed), to);
#else
  widen(_mm_srai_epi32(_mm_unpacklo_epi16(packed, packed), 16), to);
#endif
}
inline void load(const std::int8_t* at, numeric::Four& to) {
  std::int32_t four = 0;
  std::memcpy(&four, at, sizeof four);
  const __m128i packed = _mm_cvtsi32_si128(four);
#ifdef __AVX2__
  widen(_mm_cvtepi8_epi32(packed), to);
#else
  const __m128i twice = _mm_unpacklo_epi8(packed, packed);
  widen(_mm_srai_epi32(_mm_unpacklo_epi16(twice, twice), 24), to);
#endif
}

template <int Width, class Entry>
void add(const Entry* const* column, const double* factor, double* sum, std::size_t begin,
         std::size_t end) {
  const Entry* from[Width];
  double by[Width];
  for (int k = 0; k < Width; ++k) {
    from[k] = column[k];
    by[k] = factor[k];
  }
  std::size_t r = begin;
  for (; r + 8 <= end; r += 8) {
    numeric::Four low = numeric::four(sum + r), high = numeric::four(sum + r + 4), a, b;
    for (int k = 0; k < Width; ++k) {
      load(from[k] + r, a);
      load(from[k] + r + 4, b);
      low += a * by[k];
      high += b * by[k];
    }
    numeric::four(sum + r) = low;
    numeric::four(sum + r + 4) = high;
  }
  for (; r < end; ++r)
    for (int k = 0; k < Width; ++k)
      sum[r] += static_cast<double>(from[k][r]) * by[k];
}

/// Sums eight columns at a time over rows whose sums stay in the L1 cache. Eight is the number of
/// streams that the hardware prefetches.
template <class Entry>
void add_all(const Entry* const* column, const double* factor, std::size_t count, double* sum,
             std::size_t begin, std::size_t end) {
  std::size_t k = 0;
  for (; k + 8 <= count; k += 8)
    add<8>(column + k, factor + k, sum, begin, end);
  for (; k + 4 <= count; k += 4)
    add<4>(column + k, factor + k, sum, begin, end);
  for (; k < count; ++k)
    add<1>(column + k, factor + k, sum, begin, end);
}

} // namespace
} // namespace gewebe::columns
