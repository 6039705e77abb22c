#include "voxelization/ray_crossings_kernel_internal.h"

#include <immintrin.h>

// Errors are bounded as in ray_crossings_internal.h; a fused multiplication and addition errs less.

namespace gewebe::voxelization {
namespace {

double absolute(double x) {
  return x < 0 ? -x : x;
}
std::int32_t round_up(double x) {
  return _mm_cvtsd_si32(_mm_ceil_sd(_mm_setzero_pd(), _mm_set_sd(x)));
}

/// Largest integers <= x, and all ones where rounding by `error` can't have moved x across one.
struct Floor {
  __m256d value, sure;
};
Floor floor_of(__m256d x, __m256d error) {
  const __m256d value = _mm256_floor_pd(x);
  const __m256d rest = _mm256_sub_pd(x, value);
  const __m256d above = _mm256_cmp_pd(rest, error, _CMP_GT_OQ);
  const __m256d below = _mm256_cmp_pd(rest, _mm256_sub_pd(_mm256_set1_pd(1), error), _CMP_LT_OQ);
  return {value, _mm256_and_pd(above, below)};
}

__m128i lane_numbers() {
  return _mm_setr_epi32(0, 1, 2, 3);
}

/// z of a triangle's plane along a row: by how much it grows from y on, and errs.
struct Plane {
  __m256d y, slope, error;
};
struct Row {
  std::int32_t i, low, high; ///< of j
};

/// Writes the crossings of a row, whose z is `row_z` at the plane's y, four at a time. Returns
/// which lanes are sure.
inline __m256d cross_row(const Plane& plane, double row_z, const Row& row, CrossingBuffer& buffer,
                         std::size_t& count) {
  __m256d sure = _mm256_castsi256_pd(_mm256_set1_epi64x(-1));
  const __m256d start = _mm256_set1_pd(row_z);
  std::int32_t j = row.low;
  do {
    const __m128i js = _mm_add_epi32(_mm_set1_epi32(j), lane_numbers());
    const __m256d from_y = _mm256_sub_pd(_mm256_cvtepi32_pd(js), plane.y);
    const Floor z = floor_of(_mm256_fmadd_pd(from_y, plane.slope, start), plane.error);
    const __m128i beyond = _mm_cmpgt_epi32(js, _mm_set1_epi32(row.high - 1));
    sure = _mm256_and_pd(sure,
                         _mm256_or_pd(z.sure, _mm256_castsi256_pd(_mm256_cvtepi32_epi64(beyond))));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(buffer.i + count), _mm_set1_epi32(row.i));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(buffer.j + count), js);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(buffer.k + count),
                     _mm_add_epi32(_mm256_cvtpd_epi32(z.value), _mm_set1_epi32(1)));
    const std::int32_t some = row.high - j;
    count += static_cast<std::size_t>(some < 4 ? some : 4);
    j += 4;
  } while (j < row.high);
  return sure;
}

} // namespace

std::size_t cross_small_triangles_avx2(const TriangleList& list, std::size_t next,
                                       CrossingBuffer& buffer) {
  std::size_t count = 0, left = 0;
  const __m128i lanes = lane_numbers(), ones = _mm_set1_epi32(1);
  alignas(16) std::int32_t low[4], high[4];
  alignas(32) double row_z[4];
  for (; next < list.count; ++next) {
    if (left == crossing_capacity)
      break;
    const std::uint32_t* const t = list.corners + 3 * std::size_t{list.members[next]};
    const double* a = list.points + 3 * std::size_t{t[0]};
    const double* b = list.points + 3 * std::size_t{t[1]};
    const double* c = list.points + 3 * std::size_t{t[2]};
    const auto order = [](const double*& p, const double*& q) {
      const bool swap = q[0] < p[0];
      const double* const first = swap ? q : p;
      q = swap ? p : q;
      p = first;
    };
    order(a, b);
    order(b, c);
    order(a, b);
    std::int32_t begin = round_up(a[0]), end = round_up(c[0]);
    begin = begin < list.row_begin ? list.row_begin : begin;
    end = end > list.row_end ? list.row_end : end;
    if (begin >= end)
      continue;
    const double ux = b[0] - a[0], uy = b[1] - a[1], uz = b[2] - a[2];
    const double vx = c[0] - a[0], vy = c[1] - a[1], vz = c[2] - a[2];
    const double wx = c[0] - b[0], wy = c[1] - b[1];
    const double size_x = ux + vx, size_y = absolute(uy) + absolute(vy),
                 size_z = absolute(uz) + absolute(vz);
    const double rays = (end - begin) * (size_y + 2);
    const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    if (!(rays < small_triangle_rays) || !(absolute(nz) > 0x1p-47 * size_x * size_y)) {
      buffer.left[left++] = list.members[next];
      continue;
    }
    if (static_cast<double>(count) + rays + 4 > static_cast<double>(crossing_capacity))
      break;
    alignas(32) double quotient[4];
    _mm256_store_pd(quotient,
                    _mm256_div_pd(_mm256_setr_pd(vy, uy, wy, 1), _mm256_setr_pd(vx, ux, wx, nz)));
    const double slope_x = -nx * quotient[3], slope_y = -ny * quotient[3];
    const double error = 0x1p-47 * (size_x * size_y * size_z) * absolute(quotient[3]) +
                         0x1p-50 * (absolute(a[2]) + size_z);
    const __m256d ax = _mm256_set1_pd(a[0]), ay = _mm256_set1_pd(a[1]), bx = _mm256_set1_pd(b[0]);
    const Plane plane{ay, _mm256_set1_pd(slope_y), _mm256_set1_pd(error)};
    const __m256d long_error = _mm256_set1_pd(0x1p-49 * (absolute(a[1]) + absolute(vy)));
    __m256d sure = _mm256_castsi256_pd(_mm256_set1_epi64x(-1));
    const std::size_t start = count;
    for (std::int32_t i = begin; i < end; i += 4) {
      const __m256d row = _mm256_cvtepi32_pd(_mm_add_epi32(_mm_set1_epi32(i), lanes));
      const __m256d from_a = _mm256_sub_pd(row, ax);
      const __m256d late = _mm256_cmp_pd(row, bx, _CMP_GE_OQ);
      const auto pick = [&](double early, double later) {
        return _mm256_blendv_pd(_mm256_set1_pd(early), _mm256_set1_pd(later), late);
      };
      const Floor first =
          floor_of(_mm256_fmadd_pd(from_a, _mm256_set1_pd(quotient[0]), ay), long_error);
      const Floor second =
          floor_of(_mm256_fmadd_pd(_mm256_sub_pd(row, pick(a[0], b[0])),
                                   pick(quotient[1], quotient[2]), pick(a[1], b[1])),
                   pick(0x1p-49 * (absolute(a[1]) + absolute(uy)),
                        0x1p-49 * (absolute(b[1]) + absolute(wy))));
      const __m256d outside =
          _mm256_cmp_pd(row, _mm256_set1_pd(static_cast<double>(end)), _CMP_GE_OQ);
      sure = _mm256_and_pd(sure, _mm256_or_pd(outside, _mm256_and_pd(first.sure, second.sure)));
      _mm_store_si128(
          reinterpret_cast<__m128i*>(low),
          _mm_add_epi32(_mm256_cvtpd_epi32(_mm256_min_pd(first.value, second.value)), ones));
      _mm_store_si128(
          reinterpret_cast<__m128i*>(high),
          _mm_add_epi32(_mm256_cvtpd_epi32(_mm256_max_pd(first.value, second.value)), ones));
      _mm256_store_pd(row_z,
                      _mm256_fmadd_pd(from_a, _mm256_set1_pd(slope_x), _mm256_set1_pd(a[2])));
      // Where an edge is unsure the bounds below may be off, by one at most.
      const std::int32_t rows = end - i < 4 ? end - i : 4;
      for (std::int32_t r = 0; r < rows; ++r)
        sure = _mm256_and_pd(sure,
                             cross_row(plane, row_z[r], {i + r, low[r], high[r]}, buffer, count));
    }
    if (_mm256_movemask_pd(sure) != 0xf) {
      count = start;
      buffer.left[left++] = list.members[next];
    }
  }
  buffer.count = count;
  buffer.left_count = left;
  return next;
}

} // namespace gewebe::voxelization
