#include "density/density_add_internal.h"

#include <immintrin.h>

namespace gewebe::density {
namespace {

/// Byte m of entry b: sixteen times the number of the m-th bit that is set in b.
struct SetBits {
  constexpr SetBits() {
    for (unsigned bits = 0; bits < 256; ++bits) {
      unsigned count = 0;
      for (unsigned bit = 0; bit < 8; ++bit)
        if ((bits >> bit & 1) != 0)
          numbers[bits] |= std::uint64_t{16} * bit << 8 * count++;
    }
  }
  std::uint64_t numbers[256] = {};
};
constexpr SetBits set_bits;

__m256 added(__m256 sum, const float* rest, const Rows& rows) {
  const __m256 u = _mm256_max_ps(_mm256_sub_ps(_mm256_broadcast_ss(rest), _mm256_load_ps(rows.z2)),
                                 _mm256_setzero_ps());
  const __m256 factor =
      _mm256_fmadd_ps(_mm256_broadcast_ss(&rows.cubic), u, _mm256_broadcast_ss(&rows.square));
  return _mm256_fmadd_ps(_mm256_mul_ps(u, u), factor, sum);
}

struct OneRow {
  static std::size_t list(const LeafParticle* particles, std::size_t count, Chunk& c) {
    Item* items = c.items;
    for (std::size_t n = 0; n < count; ++n) {
      const LeafParticle& p = particles[n];
      Rows& rows = c.rows[n];
      const auto [rest_x, y2, least_of_four] = set_rows(p, rows);
      for (int i = 0; i < 8; ++i)
        _mm256_store_ps(rows.rest + std::ptrdiff_t{8} * i,
                        _mm256_sub_ps(_mm256_permutevar8x32_ps(rest_x, _mm256_set1_epi32(i)), y2));
      // A half slice is in reach where its nearest row is.
      const __m256 nearest =
          _mm256_permutevar8x32_ps(least_of_four, _mm256_setr_epi32(0, 4, 0, 4, 0, 4, 0, 4));
      const __m256 least = _mm256_set1_ps(least_square(p));
      for (int i = 0; i < 8; i += 4) {
        const __m256i lanes = _mm256_setr_epi32(i, i, i + 1, i + 1, i + 2, i + 2, i + 3, i + 3);
        const __m256 rest = _mm256_sub_ps(_mm256_permutevar8x32_ps(rest_x, lanes), nearest);
        const auto reached =
            static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(rest, least, _CMP_GT_OQ)));
        const __m256i bits = _mm256_cvtepu8_epi32(
            _mm_cvtsi64_si128(static_cast<long long>(set_bits.numbers[reached])));
        const __m256i first = _mm256_set1_epi32(static_cast<int>(n * sizeof(Rows)) + 32 * i);
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(items), _mm256_add_epi32(first, bits));
        items += __builtin_popcount(reached);
      }
    }
    return static_cast<std::size_t>(items - c.items);
  }

  static void add(const Rows& rows, const float* rest, float* values) {
    for (std::size_t n = 0; n < 4; ++n)
      _mm256_storeu_ps(values + 8 * n, added(_mm256_loadu_ps(values + 8 * n), rest + n, rows));
  }

  /// Eight rows stay in registers while all particles pass. (Inlined, GCC 12 makes it a fifth
  /// slower.)
  __attribute__((noinline)) static void add_slice(const Rows* rows, std::size_t count,
                                                  std::size_t slice, float* values) {
    __m256 sum[8] = {_mm256_loadu_ps(values + 0),
                     _mm256_loadu_ps(values + 8),
                     _mm256_loadu_ps(values + 16),
                     _mm256_loadu_ps(values + 24),
                     _mm256_loadu_ps(values + 32),
                     _mm256_loadu_ps(values + 40),
                     _mm256_loadu_ps(values + 48),
                     _mm256_loadu_ps(values + 56)}; // a loop becomes memcpy, which stalls
    for (std::size_t n = 0; n < count; ++n) {
      const float* const rest = rows[n].rest + slice * 8;
      for (std::size_t row = 0; row < 8; ++row)
        sum[row] = added(sum[row], rest + row, rows[n]);
    }
    _mm256_storeu_ps(values + 0, sum[0]);
    _mm256_storeu_ps(values + 8, sum[1]);
    _mm256_storeu_ps(values + 16, sum[2]);
    _mm256_storeu_ps(values + 24, sum[3]);
    _mm256_storeu_ps(values + 32, sum[4]);
    _mm256_storeu_ps(values + 40, sum[5]);
    _mm256_storeu_ps(values + 48, sum[6]);
    _mm256_storeu_ps(values + 56, sum[7]);
  }
};

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
  add_density<OneRow>(particles, count, values);
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

} // namespace gewebe::density
