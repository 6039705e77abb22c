#pragma once
// The body of single_kernel_*.cpp; each of these files compiles it for one instruction set.

#include "linalg/single_factor_internal.h"

#include <cstddef>
#include <cstdint>

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace gewebe::linalg {
namespace {

using Eight = float __attribute__((vector_size(32), aligned(4), may_alias));

inline const Eight& eight(const float* at) {
  return *reinterpret_cast<const Eight*>(at);
}
inline Eight& eight(float* at) { // NOLINT(readability-non-const-parameter)
  return *reinterpret_cast<Eight*>(at);
}

/// Eight entries as numbers. (A vector would be returned by another rule on each level.)
inline void read(const std::int16_t* at, Eight& to) {
#ifdef __AVX2__ // which compilers don't find by themselves
  to = _mm256_cvtepi32_ps(
      _mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at))));
#else
  using Entries = std::int16_t __attribute__((vector_size(16), aligned(2), may_alias));
  using Whole = std::int32_t __attribute__((vector_size(32)));
  using Numbers = float __attribute__((vector_size(32)));
  to = __builtin_convertvector(
      __builtin_convertvector(*reinterpret_cast<const Entries*>(at), Whole), Numbers);
#endif
}

/// The sums of eight vectors.
inline void sums_of(const Eight (&v)[8], float* sums) {
  Eight two[4], four[2];
  for (std::size_t k = 0; k < 4; ++k)
    two[k] = __builtin_shufflevector(v[2 * k], v[2 * k + 1], 0, 8, 2, 10, 4, 12, 6, 14) +
             __builtin_shufflevector(v[2 * k], v[2 * k + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  for (std::size_t k = 0; k < 2; ++k)
    four[k] = __builtin_shufflevector(two[2 * k], two[2 * k + 1], 0, 1, 8, 9, 4, 5, 12, 13) +
              __builtin_shufflevector(two[2 * k], two[2 * k + 1], 2, 3, 10, 11, 6, 7, 14, 15);
  eight(sums) = __builtin_shufflevector(four[0], four[1], 0, 1, 2, 3, 8, 9, 10, 11) +
                __builtin_shufflevector(four[0], four[1], 4, 5, 6, 7, 12, 13, 14, 15);
}

/// to = a square matrix by columns, times x.
template <std::size_t Width>
inline void times(const float* square, const float* x, float* to) {
  float even[Width]{}, odd[Width]{};
  for (std::size_t c = 0; c < Width; c += 2)
    for (std::size_t r = 0; r < Width; ++r) {
      even[r] += square[c * Width + r] * x[c];
      odd[r] += square[(c + 1) * Width + r] * x[c + 1];
    }
  for (std::size_t r = 0; r < Width; ++r)
    to[r] = even[r] + odd[r];
}

/// Numbers of a panel in `squares`.
template <std::size_t Width>
inline constexpr std::size_t of_square = 2 * Width * Width + Width;

template <std::size_t Width>
inline void forward_panel(const SingleFront& f, std::size_t c, const std::int16_t*& l,
                          const float*& square, float* rows) {
  const std::size_t own = f.own(c), steps = f.steps(c);
  const float* const scale = square + 2 * Width * Width;
  float x[Width]{}, z[Width];
  for (std::size_t k = 0; k < own; ++k)
    x[k] = rows[c + k];
  times<Width>(square, x, z);
  for (std::size_t k = 0; k < own; ++k)
    rows[c + k] = z[k];
  for (std::size_t k = 0; k < Width; ++k)
    z[k] *= scale[k];
  float* y = rows + c + own;
  Eight entries;
  for (std::size_t n = 0; n < steps; ++n) {
    Eight even = eight(y), odd{};
    for (std::size_t k = 0; k < Width; k += 2) {
      read(l + 8 * k, entries);
      even -= entries * z[k];
      read(l + 8 * k + 8, entries);
      odd += entries * z[k + 1];
    }
    eight(y) = even - odd;
    l += 8 * Width;
    y += 8;
  }
  square += of_square<Width>;
}

/// `l` and `square` are those behind the panel.
template <std::size_t Width>
inline void backward_panel(const SingleFront& f, std::size_t c, const std::int16_t*& l,
                           const float*& square, float* rows) {
  const std::size_t own = f.own(c), steps = f.steps(c);
  square -= of_square<Width>;
  l -= 8 * Width * steps;
  const float* const scale = square + 2 * Width * Width;
  const float* y = rows + c + own;
  const std::int16_t* at = l;
  Eight sum[8]{}, entries;
  for (std::size_t n = 0; n < steps; ++n) {
    const Eight values = eight(y);
    for (std::size_t k = 0; k < Width; ++k) {
      read(at + 8 * k, entries);
      sum[k] += entries * values;
    }
    at += 8 * Width;
    y += 8;
  }
  float sums[8], x[Width]{}, z[Width];
  sums_of(sum, sums);
  for (std::size_t k = 0; k < own; ++k)
    x[k] = rows[c + k] - sums[k] * scale[k];
  times<Width>(square + Width * Width, x, z);
  for (std::size_t k = 0; k < own; ++k)
    rows[c + k] = z[k];
}

inline void forward(const SingleFront& f, float* rows) {
  const std::int16_t* l = f.l;
  const float* square = f.squares;
  for (std::size_t c = 0; c < f.columns;)
    if (f.width(c) == 8) {
      forward_panel<8>(f, c, l, square, rows);
      c += 8;
    } else {
      forward_panel<4>(f, c, l, square, rows);
      c += 4;
    }
}

inline void backward(const SingleFront& f, float* rows) {
  const std::int16_t* l = f.l;
  const float* square = f.squares;
  std::size_t c = 0; // behind the last panel
  for (; c < f.columns; c += f.width(c)) {
    l += 8 * f.width(c) * f.steps(c);
    square += f.width(c) == 8 ? of_square<8> : of_square<4>;
  }
  while (c > 0) {
    const bool narrow = c % 8 == 4; // as none but the last one is
    c -= narrow ? 4 : 8;
    if (narrow)
      backward_panel<4>(f, c, l, square, rows);
    else
      backward_panel<8>(f, c, l, square, rows);
  }
}

} // namespace
} // namespace gewebe::linalg
