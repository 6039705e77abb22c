#pragma once
// The body of column_sum_*.cpp, each of which compiles it for its instruction set.

#include "compliance/column_sum.h"

namespace gewebe {
namespace {

using Four = double __attribute__((vector_size(32), aligned(8), may_alias));
using FourSingle = float __attribute__((vector_size(16), aligned(4), may_alias));
using FourShort = std::int16_t __attribute__((vector_size(8), aligned(2), may_alias));
using FourByte = std::int8_t __attribute__((vector_size(4), aligned(1), may_alias));

inline const Four& four(const double* at) {
  return *reinterpret_cast<const Four*>(at);
}
inline Four& four(double* at) { // NOLINT(readability-non-const-parameter)
  return *reinterpret_cast<Four*>(at);
}

inline void load(const double* at, Four& to) {
  to = four(at);
}
inline void load(const float* at, Four& to) {
  to = __builtin_convertvector(*reinterpret_cast<const FourSingle*>(at), Four);
}
inline void load(const std::int16_t* at, Four& to) {
  to = __builtin_convertvector(*reinterpret_cast<const FourShort*>(at), Four);
}
inline void load(const std::int8_t* at, Four& to) {
  to = __builtin_convertvector(*reinterpret_cast<const FourByte*>(at), Four);
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
    Four low = four(sum + r), high = four(sum + r + 4), a, b;
    for (int k = 0; k < Width; ++k) {
      load(from[k] + r, a);
      load(from[k] + r + 4, b);
      low += a * by[k];
      high += b * by[k];
    }
    four(sum + r) = low;
    four(sum + r + 4) = high;
  }
  for (; r < end; ++r)
    for (int k = 0; k < Width; ++k)
      sum[r] += static_cast<double>(from[k][r]) * by[k];
}

/// Eight columns at a time over rows whose sums stay in the first cache: so many streams as the
/// hardware fetches ahead.
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
} // namespace gewebe
