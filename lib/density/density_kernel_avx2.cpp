#include "density/density_kernel_internal.h"

#include <immintrin.h>

namespace gewebe {
namespace {

constexpr std::size_t chunk = 32; // particles whose rows fit in the first-level cache

/// What a leaf's rows need of some particles. With rest(i,j) = 1 − sx² − sy² a voxel has
/// u = rest − sz².
struct Chunk {
  alignas(32) float rest[chunk][64];
  alignas(32) float z2[chunk][8];
  float cubic[chunk], square[chunk];
  /// Bit h of byte n: particle n reaches half slice h (four rows), and half slice 8 + h.
  alignas(32) std::uint8_t low[chunk], high[chunk];
};

__m256 scaled_square(__m256 ramp, float center, __m256 inverse) {
  const __m256 s = _mm256_mul_ps(_mm256_sub_ps(ramp, _mm256_set1_ps(center)), inverse);
  return _mm256_mul_ps(s, s);
}

float smallest(__m256 v) {
  __m128 m = _mm_min_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
  m = _mm_min_ps(m, _mm_movehl_ps(m, m));
  return _mm_cvtss_f32(_mm_min_ss(m, _mm_movehdup_ps(m)));
}

/// Returns the half slices that every particle reaches.
std::uint32_t prepare(const LeafParticle* particles, std::size_t count, Chunk& c) {
  const __m256 ramp = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7);
  std::uint32_t common = 0xffff;
  for (std::size_t n = 0; n < count; ++n) {
    const LeafParticle p = particles[n];
    const __m256 inverse = _mm256_set1_ps(p.inverse_radius);
    const __m256 y2 = scaled_square(ramp, p.y, inverse);
    const __m256 z2 = scaled_square(ramp, p.z, inverse);
    alignas(32) float rest_x[8];
    _mm256_store_ps(rest_x, _mm256_sub_ps(_mm256_set1_ps(1), scaled_square(ramp, p.x, inverse)));
    _mm256_store_ps(c.z2[n], z2);
    c.cubic[n] = p.weight * (4.0F / 9);
    c.square[n] = p.weight * (5.0F / 9);
    for (std::size_t i = 0; i < 8; ++i)
      _mm256_store_ps(c.rest[n] + i * 8, _mm256_sub_ps(_mm256_broadcast_ss(rest_x + i), y2));
    // Of an axis' squares the largest is at an end: four corner rows tell whether all are reached.
    const float z2_least = smallest(z2);
    const float* const rest = c.rest[n];
    std::uint32_t reached = 0xffff;
    if (!(rest[0] > z2_least && rest[7] > z2_least && rest[56] > z2_least && rest[63] > z2_least)) {
      reached = 0;
      for (std::size_t i = 0; i < 8; ++i) {
        const int rows = _mm256_movemask_ps(
            _mm256_cmp_ps(_mm256_load_ps(rest + i * 8), _mm256_set1_ps(z2_least), _CMP_GT_OQ));
        reached |= ((rows & 15) != 0 ? 1U : 0U) << 2 * i | ((rows >> 4) != 0 ? 2U : 0U) << 2 * i;
      }
    }
    c.low[n] = static_cast<std::uint8_t>(reached);
    c.high[n] = static_cast<std::uint8_t>(reached >> 8);
    common &= reached;
  }
  return common;
}

/// u² (4w/9 u + 5w/9) added to a row.
__m256 add_row(__m256 sum, const float* rest, __m256 z2, __m256 cubic, __m256 square) {
  const __m256 u = _mm256_max_ps(_mm256_sub_ps(_mm256_broadcast_ss(rest), z2), _mm256_setzero_ps());
  return _mm256_fmadd_ps(_mm256_mul_ps(u, u), _mm256_fmadd_ps(cubic, u, square), sum);
}

/// Eight rows stay in registers while all particles pass. (Inlined, GCC 12 makes it a fifth
/// slower.)
__attribute__((noinline)) void add_slice(const Chunk& c, std::size_t count, std::size_t slice,
                                         float* rows) {
  __m256 sum[8] = {_mm256_loadu_ps(rows + 0),
                   _mm256_loadu_ps(rows + 8),
                   _mm256_loadu_ps(rows + 16),
                   _mm256_loadu_ps(rows + 24),
                   _mm256_loadu_ps(rows + 32),
                   _mm256_loadu_ps(rows + 40),
                   _mm256_loadu_ps(rows + 48),
                   _mm256_loadu_ps(rows + 56)}; // a loop becomes memcpy, which stalls
  for (std::size_t n = 0; n < count; ++n) {
    const __m256 z2 = _mm256_load_ps(c.z2[n]);
    const __m256 cubic = _mm256_broadcast_ss(c.cubic + n);
    const __m256 square = _mm256_broadcast_ss(c.square + n);
    const float* const rest = c.rest[n] + slice * 8;
    for (std::size_t row = 0; row < 8; ++row)
      sum[row] = add_row(sum[row], rest + row, z2, cubic, square);
  }
  _mm256_storeu_ps(rows + 0, sum[0]);
  _mm256_storeu_ps(rows + 8, sum[1]);
  _mm256_storeu_ps(rows + 16, sum[2]);
  _mm256_storeu_ps(rows + 24, sum[3]);
  _mm256_storeu_ps(rows + 32, sum[4]);
  _mm256_storeu_ps(rows + 40, sum[5]);
  _mm256_storeu_ps(rows + 48, sum[6]);
  _mm256_storeu_ps(rows + 56, sum[7]);
}

/// Bit n: particle n reaches the half slice.
std::uint32_t reaching(const Chunk& c, std::size_t count, std::size_t half) {
  const std::uint8_t* const bytes = half < 8 ? c.low : c.high;
  const __m256i all = _mm256_load_si256(reinterpret_cast<const __m256i*>(bytes));
  const int bits = _mm256_movemask_epi8(
      _mm256_sll_epi16(all, _mm_cvtsi32_si128(7 - static_cast<int>(half & 7))));
  return static_cast<std::uint32_t>(bits) &
         static_cast<std::uint32_t>(~(~std::uint64_t{0} << count));
}

/// Four rows, and only the particles that reach them.
__attribute__((noinline)) void add_half_slice(const Chunk& c, std::uint32_t particles,
                                              std::size_t half, float* rows) {
  __m256 sum[4] = {_mm256_loadu_ps(rows + 0), _mm256_loadu_ps(rows + 8), _mm256_loadu_ps(rows + 16),
                   _mm256_loadu_ps(rows + 24)}; // a loop becomes memcpy, which stalls
  for (; particles != 0; particles &= particles - 1) {
    const auto n = static_cast<std::size_t>(__builtin_ctz(particles));
    const __m256 z2 = _mm256_load_ps(c.z2[n]);
    const __m256 cubic = _mm256_broadcast_ss(c.cubic + n);
    const __m256 square = _mm256_broadcast_ss(c.square + n);
    const float* const rest = c.rest[n] + half * 4;
    for (std::size_t row = 0; row < 4; ++row)
      sum[row] = add_row(sum[row], rest + row, z2, cubic, square);
  }
  _mm256_storeu_ps(rows + 0, sum[0]);
  _mm256_storeu_ps(rows + 8, sum[1]);
  _mm256_storeu_ps(rows + 16, sum[2]);
  _mm256_storeu_ps(rows + 24, sum[3]);
}

__m256 magnitude(__m256 v) {
  return _mm256_andnot_ps(_mm256_set1_ps(-0.0F), v);
}
__m256 clamped(__m256 v) {
  return _mm256_max_ps(v, _mm256_setzero_ps());
}
__m256 density(__m256 u) {
  return _mm256_mul_ps(_mm256_mul_ps(u, u),
                       _mm256_fmadd_ps(_mm256_set1_ps(4.0F / 9), u, _mm256_set1_ps(5.0F / 9)));
}

/// The children's centres along each axis, relative to the origin.
struct Centers {
  explicit Centers(const Children& children) {
    const float near = (children.size - 1) / 2;
    const float far = children.size + near;
    x = _mm256_setr_ps(near, near, near, near, far, far, far, far);
    y = _mm256_setr_ps(near, near, far, far, near, near, far, far);
    z = _mm256_setr_ps(near, far, near, far, near, far, near, far);
    half = near + children.size * box_slack;
  }
  __m256 x, y, z;
  float half;
};

} // namespace

void add_density_avx2(const LeafParticle* particles, std::size_t count, float* values) {
  Chunk c;
  for (std::size_t begin = 0; begin < count; begin += chunk) {
    const std::size_t some = count - begin < chunk ? count - begin : chunk;
    const std::uint32_t common = prepare(particles + begin, some, c);
    for (std::size_t slice = 0; slice < 8; ++slice) {
      float* const rows = values + slice * 64;
      if ((common >> 2 * slice & 3) == 3) {
        add_slice(c, some, slice, rows);
        continue;
      }
      for (std::size_t half = 2 * slice; half < 2 * slice + 2; ++half)
        if (const std::uint32_t some_reach = reaching(c, some, half); some_reach != 0)
          add_half_slice(c, some_reach, half, values + half * 32);
    }
  }
}

void reach_children_avx2(const IndexParticle* particles, const std::uint32_t* list,
                         std::size_t count, const Children& children, float margin,
                         std::uint8_t* masks) {
  const Centers centers(children);
  const __m256 half = _mm256_set1_ps(centers.half + margin), limit = _mm256_set1_ps(reach_limit);
  for (std::size_t n = 0; n < count; ++n) {
    const IndexParticle& p = particles[list[n]];
    const __m256 inverse = _mm256_set1_ps(p.inverse_radius);
    const auto axis2 = [&](__m256 center, double x, double origin) {
      const __m256 offset = _mm256_sub_ps(center, _mm256_set1_ps(static_cast<float>(x - origin)));
      const __m256 low = _mm256_mul_ps(clamped(_mm256_sub_ps(magnitude(offset), half)), inverse);
      return _mm256_mul_ps(low, low);
    };
    const __m256 nearest2 = _mm256_add_ps(_mm256_add_ps(axis2(centers.x, p.x, children.origin[0]),
                                                        axis2(centers.y, p.y, children.origin[1])),
                                          axis2(centers.z, p.z, children.origin[2]));
    masks[n] =
        static_cast<std::uint8_t>(_mm256_movemask_ps(_mm256_cmp_ps(nearest2, limit, _CMP_LT_OQ)));
  }
}

void bound_children_avx2(const IndexParticle* particles, const std::uint32_t* list,
                         std::size_t count, const Children& children, std::uint8_t* masks,
                         ChildBounds& bounds) {
  const Centers centers(children);
  const __m256 half = _mm256_set1_ps(centers.half), one = _mm256_set1_ps(1);
  const __m256 limit = _mm256_set1_ps(reach_limit), zero = _mm256_setzero_ps();
  __m256 lower = zero, upper = zero, absolute = zero, weights = zero, curvature = zero;
  __m256 value = zero, gx = zero, gy = zero, gz = zero;
  for (std::size_t n = 0; n < count; ++n) {
    const IndexParticle& p = particles[list[n]];
    const __m256 weight = _mm256_set1_ps(p.weight);
    const __m256 inverse2 = _mm256_set1_ps(p.inverse_radius * p.inverse_radius);
    __m256 nearest2 = zero, nearer2 = zero, farthest2 = zero, farthest = zero, center2 = zero;
    const auto along = [&](__m256 center, double x, double origin) {
      const __m256 offset = _mm256_sub_ps(center, _mm256_set1_ps(static_cast<float>(x - origin)));
      const __m256 d = magnitude(offset);
      const __m256 low = clamped(_mm256_sub_ps(d, half));
      const __m256 further = clamped(_mm256_sub_ps(low, one)); // one voxel further out
      const __m256 high = _mm256_add_ps(d, half);
      const __m256 low2 = _mm256_mul_ps(low, low);
      nearest2 = _mm256_add_ps(nearest2, low2);
      nearer2 = _mm256_max_ps(nearer2, _mm256_fnmadd_ps(further, further, low2));
      farthest2 = _mm256_fmadd_ps(high, high, farthest2);
      farthest = _mm256_max_ps(farthest, high);
      center2 = _mm256_fmadd_ps(d, d, center2);
      return offset;
    };
    const __m256 dx = along(centers.x, p.x, children.origin[0]);
    const __m256 dy = along(centers.y, p.y, children.origin[1]);
    const __m256 dz = along(centers.z, p.z, children.origin[2]);
    const __m256 t_near = _mm256_mul_ps(inverse2, _mm256_sub_ps(nearest2, nearer2));
    const __m256 t_far = _mm256_mul_ps(
        inverse2, _mm256_add_ps(farthest2, _mm256_fmadd_ps(_mm256_set1_ps(2), farthest, one)));
    const __m256 u = clamped(_mm256_fnmadd_ps(inverse2, center2, one));
    const __m256 max = _mm256_mul_ps(weight, density(clamped(_mm256_sub_ps(one, t_near))));
    const __m256 min = _mm256_mul_ps(weight, density(clamped(_mm256_sub_ps(one, t_far))));
    upper = _mm256_add_ps(upper, p.weight > 0 ? max : min);
    lower = _mm256_add_ps(lower, p.weight > 0 ? min : max);
    absolute = _mm256_add_ps(absolute, magnitude(max));
    const __m256 in_reach = _mm256_cmp_ps(t_near, limit, _CMP_LT_OQ);
    masks[n] = static_cast<std::uint8_t>(_mm256_movemask_ps(in_reach));
    const __m256 counted = _mm256_and_ps(in_reach, magnitude(weight));
    weights = _mm256_add_ps(weights, counted);
    curvature = _mm256_fmadd_ps(counted, inverse2, curvature);
    value = _mm256_fmadd_ps(weight, density(u), value);
    // d density/d t = -u (10 + 12 u)/9
    const __m256 slope = _mm256_mul_ps(
        _mm256_mul_ps(_mm256_mul_ps(_mm256_set1_ps(-2), weight), _mm256_mul_ps(inverse2, u)),
        _mm256_fmadd_ps(_mm256_set1_ps(12.0F / 9), u, _mm256_set1_ps(10.0F / 9)));
    gx = _mm256_fmadd_ps(slope, dx, gx);
    gy = _mm256_fmadd_ps(slope, dy, gy);
    gz = _mm256_fmadd_ps(slope, dz, gz);
  }
  gx = magnitude(gx);
  gy = magnitude(gy);
  gz = magnitude(gz);
  const float reach2 = 2 * centers.half * centers.half + (centers.half + 1) * (centers.half + 1);
  __m256 spread = _mm256_mul_ps(half, _mm256_add_ps(_mm256_add_ps(gx, gy), gz));
  spread = _mm256_add_ps(spread, _mm256_max_ps(_mm256_max_ps(gx, gy), gz));
  spread = _mm256_fmadd_ps(_mm256_set1_ps(0.5F * curvature_bound * reach2), curvature, spread);
  const __m256 terms = _mm256_set1_ps(accumulation_rounding * static_cast<float>(count + 8));
  const __m256 rounding =
      _mm256_fmadd_ps(terms, absolute, _mm256_mul_ps(_mm256_set1_ps(term_rounding), weights));
  _mm256_storeu_ps(bounds.lower,
                   _mm256_sub_ps(_mm256_max_ps(lower, _mm256_sub_ps(value, spread)), rounding));
  _mm256_storeu_ps(bounds.upper,
                   _mm256_add_ps(_mm256_min_ps(upper, _mm256_add_ps(value, spread)), rounding));
}

} // namespace gewebe
