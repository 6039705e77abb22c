#pragma once
// Body of spring_kernel_*.cpp. Each of these files compiles it for its instruction set.

#include "dynamics/spring_kernel.h"

#include <immintrin.h>

namespace gewebe::dynamics {
namespace {

using Four = double __attribute__((vector_size(32), may_alias));
using FourBits = long long __attribute__((vector_size(32)));

inline const Four& four(const double* at) {
  return *reinterpret_cast<const Four*>(at);
}
inline Four& four(double* at) { // NOLINT(readability-non-const-parameter)
  return *reinterpret_cast<Four*>(at);
}

/// Square roots of non-negative numbers, rounded correctly.
inline void square_root(const Four& x, Four& root) {
#if defined(__AVX__)
  root = _mm256_sqrt_pd(x);
#else
  const __m128d low = _mm_sqrt_pd(_mm_set_pd(x[1], x[0])),
                high = _mm_sqrt_pd(_mm_set_pd(x[3], x[2]));
  root = Four{low[0], low[1], high[0], high[1]};
#endif
}

struct Three {
  Four x, y, z;
};

/// Transposes four rows (x, y, z, 0) to four x, four y, four z.
inline void columns(const Four& a, const Four& b, const Four& c, const Four& d, Three& to) {
  const Four ac = __builtin_shufflevector(a, b, 0, 4, 2, 6); // ax bx az bz
  const Four ay = __builtin_shufflevector(a, b, 1, 5, 3, 7); // ay by . .
  const Four cc = __builtin_shufflevector(c, d, 0, 4, 2, 6);
  const Four cy = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  to.x = __builtin_shufflevector(ac, cc, 0, 1, 4, 5);
  to.y = __builtin_shufflevector(ay, cy, 0, 1, 4, 5);
  to.z = __builtin_shufflevector(ac, cc, 2, 3, 6, 7);
}

/// The reverse.
inline void rows(const Three& from, Four& a, Four& b, Four& c, Four& d) {
  const Four zero{};
  const Four xy = __builtin_shufflevector(from.x, from.y, 0, 4, 2, 6); // ax ay cx cy
  const Four xy2 = __builtin_shufflevector(from.x, from.y, 1, 5, 3, 7);
  const Four z = __builtin_shufflevector(from.z, zero, 0, 4, 2, 6); // az 0 cz 0
  const Four z2 = __builtin_shufflevector(from.z, zero, 1, 5, 3, 7);
  a = __builtin_shufflevector(xy, z, 0, 1, 4, 5);
  b = __builtin_shufflevector(xy2, z2, 0, 1, 4, 5);
  c = __builtin_shufflevector(xy, z, 2, 3, 6, 7);
  d = __builtin_shufflevector(xy2, z2, 2, 3, 6, 7);
}

/// `offset` is that of the row's NodeRest.
inline const double* at(const NodeRest* base, std::uint64_t offset) {
  return reinterpret_cast<const double*>(reinterpret_cast<const char*>(base) + offset);
}
inline const double* at(const NodeRow* base, std::uint64_t offset) {
  static_assert(sizeof(NodeRow) == 2 * sizeof(NodeRest));
  return reinterpret_cast<const double*>(reinterpret_cast<const char*>(base) + 2 * offset);
}
inline double* at(NodeRow* base, std::uint64_t offset) {
  return reinterpret_cast<double*>(reinterpret_cast<char*>(base) + 2 * offset);
}

/// Difference of positions of two rows, as that at rest plus that of the displacements; and that of
/// their velocities.
inline void between(const NodeRest* rest, const NodeRow* now, std::uint64_t i, std::uint64_t j,
                    Four& along, Four& speed) {
  along = (four(at(rest, j)) - four(at(rest, i))) + (four(at(now, j)) - four(at(now, i)));
  speed = four(at(now, j) + 4) - four(at(now, i) + 4);
}

/// Software pipeline. One group has a latency of a hundred cycles, a fifth of them in the divider.
/// Groups overlap best if each stage of a group runs beside the other stages of earlier groups.
inline constexpr std::size_t apart = 4;
inline constexpr std::size_t underway = 2 * apart; ///< a power of two

struct Underway {
  Three along[underway];
  Four square[underway], speed[underway]; ///< length², speed · along, then the pull over the length
};

inline void measure(const SpringGroup& g, const NodeRest* rest, const NodeRow* now, Three& along,
                    Four& square, Four& rate) {
  Four along0, along1, along2, along3, speed0, speed1, speed2, speed3;
  between(rest, now, g.i[0], g.j[0], along0, speed0);
  between(rest, now, g.i[1], g.j[1], along1, speed1);
  between(rest, now, g.i[2], g.j[2], along2, speed2);
  between(rest, now, g.i[3], g.j[3], along3, speed3);
  Three d, speed;
  columns(along0, along1, along2, along3, d);
  columns(speed0, speed1, speed2, speed3, speed);
  square = d.x * d.x + d.y * d.y + d.z * d.z;
  rate = speed.x * d.x + speed.y * d.y + speed.z * d.z;
  along = d;
}

/// Force over length of each spring, as in spring_force().
inline void pull_of(const SpringGroup& g, const Four& square, Four& rate) {
  Four length;
  square_root(square, length);
  const Four one{1, 1, 1, 1};
  const Four no_direction{min_square, min_square, min_square, min_square};
  const auto inverse =
      reinterpret_cast<Four>(reinterpret_cast<FourBits>(one / square) & (square > no_direction));
  rate = (four(g.stiffness) * (length - four(g.rest)) * length + four(g.damping) * rate) * inverse;
}

template <bool both_ends>
inline void add(const SpringGroup& g, const Three& along, const Four& pull, NodeRow* sum) {
  Four a, b, c, d;
  rows({pull * along.x, pull * along.y, pull * along.z}, a, b, c, d);
  const std::uint64_t i0 = g.i[0], i1 = g.i[1], i2 = g.i[2], i3 = g.i[3];
  const std::uint64_t j0 = g.j[0], j1 = g.j[1], j2 = g.j[2], j3 = g.j[3];
  four(at(sum, i0) + 4) += a;
  four(at(sum, i1) + 4) += b;
  four(at(sum, i2) + 4) += c;
  four(at(sum, i3) + 4) += d;
  if (both_ends) {
    four(at(sum, j0) + 4) -= a;
    four(at(sum, j1) + 4) -= b;
    four(at(sum, j2) + 4) -= c;
    four(at(sum, j3) + 4) -= d;
  }
}

template <bool both_ends>
inline void add_pulls(const SpringGroup* g, std::size_t count, const NodeRest* rest,
                      const NodeRow* now, NodeRow* sum) {
  Underway w;
  const auto slot = [](std::size_t n) { return n % underway; };
  for (std::size_t n = 0; n < count + 2 * apart; ++n) {
    if (n >= 2 * apart)
      add<both_ends>(g[n - 2 * apart], w.along[slot(n)], w.speed[slot(n)], sum);
    if (n < count)
      measure(g[n], rest, now, w.along[slot(n)], w.square[slot(n)], w.speed[slot(n)]);
    if (n >= apart && n - apart < count)
      pull_of(g[n - apart], w.square[slot(n - apart)], w.speed[slot(n - apart)]);
  }
}

inline bool step(const SpringBlock& block, const NodeRest* rest, const NodeTraits* traits,
                 const NodeRow* now, NodeRow* next, double h) {
  const std::size_t end = block.first + block.count;
  for (std::size_t n = block.first; n < end; ++n) {
    const double d = traits[n].drag;
    const Four drag{d, d, d, d};
    four(next[n].v) =
        four(traits[n].constant) - drag * four(now[n].v); // the fourth is multiplied by 0
  }
  add_pulls<true>(block.within, block.within_count, rest, now, next);
  add_pulls<false>(block.across, block.across_count, rest, now, next);
  const Four step{h, h, h, h}, zero{};
  Four odd{}; // not 0 where a number is not finite
  for (std::size_t n = block.first; n < end; ++n) {
    const Four v = four(now[n].v) + step * (four(next[n].v) * four(traits[n].inverse_mass));
    const Four u = four(now[n].u) + step * v;
    four(next[n].v) = v;
    four(next[n].u) = u;
    odd += zero * u + zero * v;
  }
  return odd[0] == 0 && odd[1] == 0 && odd[2] == 0;
}

} // namespace
} // namespace gewebe::dynamics
