#pragma once
// The body of column_sum_*.cpp, each of which compiles it for its instruction set.

#include "sim/column_sum.h"

#include <cstring>

namespace gewebe {
namespace {

using Four = double __attribute__((vector_size(32), aligned(8), may_alias));
using FourSingle = float __attribute__((vector_size(16), aligned(4), may_alias));

inline void four(const double* at, Four& to) {
  std::memcpy(&to, at, sizeof to);
}
inline void four(const float* at, Four& to) {
  FourSingle narrow;
  std::memcpy(&narrow, at, sizeof narrow);
  to = __builtin_convertvector(narrow, Four);
}

template <int Width, class Entry>
void add(const Entry* const* column, const double* factor, double* sum, std::size_t begin,
         std::size_t end) {
  std::size_t r = begin;
  for (; r + 8 <= end; r += 8) {
    Four low, high, a, b;
    four(sum + r, low);
    four(sum + r + 4, high);
    for (int k = 0; k < Width; ++k) {
      four(column[k] + r, a);
      four(column[k] + r + 4, b);
      low += a * factor[k];
      high += b * factor[k];
    }
    std::memcpy(sum + r, &low, sizeof low);
    std::memcpy(sum + r + 4, &high, sizeof high);
  }
  for (; r < end; ++r)
    for (int k = 0; k < Width; ++k)
      sum[r] += static_cast<double>(column[k][r]) * factor[k];
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
