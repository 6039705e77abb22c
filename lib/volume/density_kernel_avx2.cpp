#include "volume/density_kernel_internal.h"

#include <immintrin.h>

namespace gewebe {

void add_density_avx2(const LeafParticle* particles, std::size_t count, float* values) {
  const __m256 ramp = _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7);
  const __m256 one = _mm256_set1_ps(1);
  const __m256 slope = _mm256_set1_ps(-4.0F / 9);
  for (std::size_t n = 0; n < count; ++n) {
    const LeafParticle p = particles[n];
    const __m256 dz = _mm256_sub_ps(ramp, _mm256_set1_ps(p.z));
    const __m256 inverse_r2 = _mm256_set1_ps(p.inverse_r2);
    const __m256 weight = _mm256_set1_ps(p.weight);
    for (int i = 0; i < 8; ++i) {
      const float dx = static_cast<float>(i) - p.x;
      for (int j = 0; j < 8; ++j) {
        const float dy = static_cast<float>(j) - p.y;
        const float dxy2 = __builtin_fmaf(dx, dx, dy * dy);
        if (!(dxy2 * p.inverse_r2 < 1))
          continue;
        float* const row = values + (i * 64 + j * 8);
        const __m256 t = _mm256_mul_ps(_mm256_fmadd_ps(dz, dz, _mm256_set1_ps(dxy2)), inverse_r2);
        const __m256 u = _mm256_sub_ps(one, t);
        const __m256 density = _mm256_mul_ps(_mm256_mul_ps(u, u), _mm256_fmadd_ps(slope, t, one));
        const __m256 old = _mm256_loadu_ps(row);
        const __m256 sum = _mm256_fmadd_ps(weight, density, old);
        const __m256 inside = _mm256_cmp_ps(t, one, _CMP_LT_OQ);
        _mm256_storeu_ps(row, _mm256_blendv_ps(old, sum, inside));
      }
    }
  }
}

} // namespace gewebe
