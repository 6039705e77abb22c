#pragma once
// The body of single_kernel_*.cpp, each of which compiles it for its instruction set.

#include "solve/single_factor_internal.h"

#include <cstddef>
#include <cstdint>

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace gewebe {
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

/// y loses `Columns` columns, `step` entries from one to the next, times x.
template <std::size_t Columns>
inline void lose(const std::int16_t* l, std::size_t step, const float* x, std::size_t count,
                 float* y) {
  Eight entries;
  std::size_t r = 0;
  for (; r + 8 <= count; r += 8) {
    Eight sum = eight(y + r);
    for (std::size_t c = 0; c < Columns; ++c) {
      read(l + c * step + r, entries);
      sum -= entries * x[c];
    }
    eight(y + r) = sum;
  }
  for (; r < count; ++r)
    for (std::size_t c = 0; c < Columns; ++c)
      y[r] -= static_cast<float>(l[c * step + r]) * x[c];
}

/// sums += columns · y
template <std::size_t Columns>
inline void gain(const std::int16_t* l, std::size_t step, const float* y, std::size_t count,
                 float* sums) {
  Eight sum[Columns]{}, entries;
  std::size_t r = 0;
  for (; r + 8 <= count; r += 8)
    for (std::size_t c = 0; c < Columns; ++c) {
      read(l + c * step + r, entries);
      sum[c] += entries * eight(y + r);
    }
  for (std::size_t c = 0; c < Columns; ++c) {
    const Eight& s = sum[c];
    float rest = 0;
    for (std::size_t k = r; k < count; ++k)
      rest += static_cast<float>(l[c * step + k]) * y[k];
    sums[c] += ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7])) + rest;
  }
}

template <std::size_t Columns>
inline void forward_some(const SingleFront& f, std::size_t c, float* own, float* below) {
  const std::int16_t* const l = f.l + c * f.rows;
  float x[Columns];
  for (std::size_t k = 0; k < Columns; ++k) {
    for (std::size_t j = 0; j < k; ++j)
      own[c + k] -= static_cast<float>(l[j * f.rows + c + k]) * x[j];
    own[c + k] *= f.inverse[c + k];
    x[k] = own[c + k] * f.scale[c + k];
  }
  lose<Columns>(l + c + Columns, f.rows, x, f.columns - c - Columns, own + c + Columns);
  lose<Columns>(l + f.columns, f.rows, x, f.rows - f.columns, below);
}

template <std::size_t Columns>
inline void backward_some(const SingleFront& f, std::size_t c, float* own, const float* below) {
  const std::int16_t* const l = f.l + c * f.rows;
  float sums[Columns]{};
  gain<Columns>(l + f.columns, f.rows, below, f.rows - f.columns, sums);
  gain<Columns>(l + c + Columns, f.rows, own + c + Columns, f.columns - c - Columns, sums);
  for (std::size_t k = Columns; k-- > 0;) {
    for (std::size_t j = k + 1; j < Columns; ++j)
      sums[k] += static_cast<float>(l[k * f.rows + c + j]) * own[c + j];
    own[c + k] = (own[c + k] - sums[k] * f.scale[c + k]) * f.inverse[c + k];
  }
}

inline void forward(const SingleFront& f, float* own, float* below) {
  std::size_t c = 0;
  for (; c + 4 <= f.columns; c += 4)
    forward_some<4>(f, c, own, below);
  for (; c < f.columns; ++c)
    forward_some<1>(f, c, own, below);
}

inline void backward(const SingleFront& f, float* own, const float* below) {
  std::size_t c = f.columns;
  for (; c % 4 != 0; --c)
    backward_some<1>(f, c - 1, own, below);
  for (; c > 0; c -= 4)
    backward_some<4>(f, c - 4, own, below);
}

} // namespace
} // namespace gewebe
