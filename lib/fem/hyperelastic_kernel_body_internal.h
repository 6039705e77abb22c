#pragma once
// The body of hyperelastic_kernel_*.cpp; each of these files compiles it for one instruction set.

#include "fem/hyperelastic_kernel_internal.h"
#include "numeric/four_lanes.h"

#include <array>
#include <cstddef>

namespace gewebe {
namespace {

using Lanes = std::array<std::array<double, tangent_lanes>, 3>;

/// Of each node, a matrix times its gradient.
inline void multiply(const std::array<double, 9>& m, const Lanes& gradient, std::size_t count,
                     Lanes& to) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t n = 0; n < count; n += 4)
      four(&to[i][n]) = m[3 * i] * four(&gradient[0][n]) + m[3 * i + 1] * four(&gradient[1][n]) +
                        m[3 * i + 2] * four(&gradient[2][n]);
}

inline void add_tangent(const TangentPoint& q, std::size_t count, TangentSums& sums) {
  Lanes by_f, by_cofactor;
  multiply(q.f, q.gradient, count, by_f);
  multiply(q.cofactor, q.gradient, count, by_cofactor);
  const auto& [gx, gy, gz] = q.gradient;
  for (std::size_t m = 0; m < count; ++m) {
    const double x = gx[m], y = gy[m], z = gz[m];
    for (std::size_t n = m / 4 * 4; n < count; n += 4) {
      const Four &nx = four(&gx[n]), &ny = four(&gy[n]), &nz = four(&gz[n]);
      // F (∇m × ∇n) d, the axis of what turns
      const Four cx = y * nz - z * ny, cy = z * nx - x * nz, cz = x * ny - y * nx;
      const Four tx = (q.f[0] * cx + q.f[1] * cy + q.f[2] * cz) * q.d,
                 ty = (q.f[3] * cx + q.f[4] * cy + q.f[5] * cz) * q.d,
                 tz = (q.f[6] * cx + q.f[7] * cy + q.f[8] * cz) * q.d;
      const Four even = q.a * (x * nx + y * ny + z * nz);
      const auto along = [&](std::size_t i, std::size_t j, Four& to) {
        to = q.b * by_f[i][m] * four(&by_f[j][n]) +
             q.c * by_cofactor[i][m] * four(&by_cofactor[j][n]);
      };
      const auto add = [&](std::size_t i, std::size_t j, const Four& block) {
        four(&sums[3 * i + j][m][n]) += q.weight * block;
      };
      Four block;
      for (std::size_t i = 0; i < 3; ++i) {
        along(i, i, block);
        add(i, i, block + even);
      }
      along(0, 1, block);
      add(0, 1, block + tz);
      along(0, 2, block);
      add(0, 2, block - ty);
      along(1, 0, block);
      add(1, 0, block - tz);
      along(1, 2, block);
      add(1, 2, block + tx);
      along(2, 0, block);
      add(2, 0, block + ty);
      along(2, 1, block);
      add(2, 1, block - tx);
    }
  }
}

} // namespace
} // namespace gewebe
