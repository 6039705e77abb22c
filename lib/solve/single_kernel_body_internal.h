#pragma once
// The body of single_kernel_*.cpp, each of which compiles it for its instruction set.

#include "solve/single_factor_internal.h"

#include <cstddef>

namespace gewebe {
namespace {

using Eight = float __attribute__((vector_size(32), aligned(4), may_alias));

inline const Eight& eight(const float* at) {
  return *reinterpret_cast<const Eight*>(at);
}
inline Eight& eight(float* at) { // NOLINT(readability-non-const-parameter)
  return *reinterpret_cast<Eight*>(at);
}

/// y loses `Columns` columns, `step` numbers from one to the next, times x.
template <std::size_t Columns>
inline void lose(const float* l, std::size_t step, const float* x, std::size_t count, float* y) {
  std::size_t r = 0;
  for (; r + 8 <= count; r += 8) {
    Eight sum = eight(y + r);
    for (std::size_t c = 0; c < Columns; ++c)
      sum -= eight(l + c * step + r) * x[c];
    eight(y + r) = sum;
  }
  for (; r < count; ++r)
    for (std::size_t c = 0; c < Columns; ++c)
      y[r] -= l[c * step + r] * x[c];
}

/// sums += columns · y
template <std::size_t Columns>
inline void gain(const float* l, std::size_t step, const float* y, std::size_t count, float* sums) {
  Eight sum[Columns]{};
  std::size_t r = 0;
  for (; r + 8 <= count; r += 8)
    for (std::size_t c = 0; c < Columns; ++c)
      sum[c] += eight(l + c * step + r) * eight(y + r);
  for (std::size_t c = 0; c < Columns; ++c) {
    const Eight& s = sum[c];
    float rest = 0;
    for (std::size_t k = r; k < count; ++k)
      rest += l[c * step + k] * y[k];
    sums[c] += ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7])) + rest;
  }
}

template <std::size_t Columns>
inline void forward_some(const SingleFront& f, std::size_t c, float* own, float* below) {
  const float* const l = f.l + c * f.rows;
  for (std::size_t k = 0; k < Columns; ++k) {
    for (std::size_t j = 0; j < k; ++j)
      own[c + k] -= l[j * f.rows + c + k] * own[c + j];
    own[c + k] /= l[k * f.rows + c + k];
  }
  lose<Columns>(l + c + Columns, f.rows, own + c, f.columns - c - Columns, own + c + Columns);
  lose<Columns>(l + f.columns, f.rows, own + c, f.rows - f.columns, below);
}

template <std::size_t Columns>
inline void backward_some(const SingleFront& f, std::size_t c, float* own, const float* below) {
  const float* const l = f.l + c * f.rows;
  float sums[Columns]{};
  gain<Columns>(l + f.columns, f.rows, below, f.rows - f.columns, sums);
  gain<Columns>(l + c + Columns, f.rows, own + c + Columns, f.columns - c - Columns, sums);
  for (std::size_t k = Columns; k-- > 0;) {
    float value = own[c + k] - sums[k];
    for (std::size_t j = k + 1; j < Columns; ++j)
      value -= l[k * f.rows + c + j] * own[c + j];
    own[c + k] = value / l[k * f.rows + c + k];
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
