#include "volume/density_kernel_internal.h"

#include <cmath>

namespace gewebe {

void add_density_baseline(const LeafParticle* particles, std::size_t count, float* values) {
  for (std::size_t n = 0; n < count; ++n) {
    const LeafParticle p = particles[n];
    for (int i = 0; i < 8; ++i) {
      const float dx = static_cast<float>(i) - p.x;
      for (int j = 0; j < 8; ++j) {
        const float dy = static_cast<float>(j) - p.y;
        const float dxy2 = std::fma(dx, dx, dy * dy);
        if (!(dxy2 * p.inverse_r2 < 1))
          continue;
        float* const row = values + (i * 64 + j * 8);
        for (int k = 0; k < 8; ++k) {
          const float dz = static_cast<float>(k) - p.z;
          const float t = std::fma(dz, dz, dxy2) * p.inverse_r2;
          const float u = 1 - t;
          const float density = u * u * std::fma(-4.0F / 9, t, 1.0F);
          row[k] = t < 1 ? std::fma(p.weight, density, row[k]) : row[k];
        }
      }
    }
  }
}

} // namespace gewebe
