#pragma once
// Fused multiply-subtract in software: sum - a b, rounded once, for processors without FMA
// instructions. The standard library's std::fma takes some fifty times as long there.

#include <cmath>
#include <cstddef>
#include <cstdint>

// Based on: Boldo, Melquiond, Emulation of a FMA and correctly rounded sums: proved algorithms
// using rounding to odd, 2008; Dekker, A floating-point technique for extending the available
// precision, 1971 (the exact product); Knuth, The Art of Computer Programming 2, 4.2.2 (the exact
// sum).

namespace gewebe::cholesky {
namespace {

using Pair = double __attribute__((vector_size(16)));
using PairBits = std::int64_t __attribute__((vector_size(16)));

/// head + tail = value, each of half the digits. \pre |value| < 2^996
inline void split(Pair value, Pair& head, Pair& tail) {
  const Pair c = 0x1.0000002p27 * value; // 2^27 + 1
  head = c - (c - value);
  tail = value - head;
}

/// sum + error = a + b, sum rounded.
inline void exact_sum(Pair a, Pair b, Pair& sum, Pair& error) {
  sum = a + b;
  const Pair part = sum - a;
  error = (a - (sum - part)) + (b - part);
}

inline Pair magnitude(Pair value) {
  return (Pair)((PairBits)value & INT64_MAX);
}

/// The bits of std::fma(-a, b, sum), lane by lane.
inline Pair lose_fused(Pair sum, Pair a, Pair b) {
  const Pair product = a * b;
  const PairBits zero = (a == 0) | (b == 0); // then nothing is rounded but the sum
  constexpr double max = 0x1p900, min = 0x1p-900;
  const Pair size = magnitude(product);
  const PairBits usual = zero | ((size >= min) & (size <= max) & (magnitude(a) <= max) &
                                 (magnitude(b) <= max) & (magnitude(sum) <= max));
  Pair ah, al, bh, bl, th, tl, vh, vl, z, e;
  split(a, ah, al);
  split(b, bh, bl);
  const Pair rest = product - ah * bh - ah * bl - al * bh - al * bl; // product - a b, exact
  exact_sum(sum, rest, th, tl);
  exact_sum(-product, th, vh, vl);
  exact_sum(tl, vl, z, e);
  // Rounded to odd: what is not exact ends with a bit that is set.
  const PairBits bits = (PairBits)z;
  const PairBits step = (~((e > 0) ^ (z > 0)) & 2) - 1; // away from 0 or towards it
  z = (Pair)(bits + (step & (e != 0) & ((bits & 1) - 1)));
  Pair result = (Pair)((zero & (PairBits)(sum - product)) | (~zero & (PairBits)(vh + z)));
  if ((usual[0] & usual[1]) == 0) // near overflow or underflow, or no numbers
    for (std::size_t k = 0; k < 2; ++k)
      if (usual[k] == 0)
        result[k] = std::fma(-a[k], b[k], sum[k]);
  return result;
}

} // namespace
} // namespace gewebe::cholesky
