#pragma once
// The body of hyperelastic_kernel_*.cpp; each of these files compiles it for one instruction set.

#include "fem/hyperelastic_kernel_internal.h"
#include "numeric/four_lanes.h"

#include <array>
#include <cstddef>

namespace gewebe::fem {
namespace {

using Lanes = std::array<std::array<double, tangent_lanes>, 3>;

/// Of each node, a matrix times its gradient.
inline void multiply(const std::array<double, 9>& m, const Lanes& gradient, std::size_t count,
                     Lanes& to) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t n = 0; n < count; n += 4)
      numeric::four(&to[i][n]) = m[3 * i] * numeric::four(&gradient[0][n]) +
                                 m[3 * i + 1] * numeric::four(&gradient[1][n]) +
                                 m[3 * i + 2] * numeric::four(&gradient[2][n]);
}

inline void add_tangent(const TangentPoint& q, std::size_t count, TangentSums& sums) {
  Lanes by_f, by_cofactor;
  multiply(q.f, q.gradient, count, by_f);
  multiply(q.cofactor, q.gradient, count, by_cofactor);
  const auto& [gx, gy, gz] = q.gradient;
  for (std::size_t m = 0; m < count; ++m) {
    const double x = gx[m], y = gy[m], z = gz[m];
    for (std::size_t n = m / 4 * 4; n < count; n += 4) {
      const numeric::Four &nx = numeric::four(&gx[n]), &ny = numeric::four(&gy[n]),
                          &nz = numeric::four(&gz[n]);
      // F (∇m × ∇n) d, the axis of what turns
      const numeric::Four cx = y * nz - z * ny, cy = z * nx - x * nz, cz = x * ny - y * nx;
      const numeric::Four tx = (q.f[0] * cx + q.f[1] * cy + q.f[2] * cz) * q.d,
                          ty = (q.f[3] * cx + q.f[4] * cy + q.f[5] * cz) * q.d,
                          tz = (q.f[6] * cx + q.f[7] * cy + q.f[8] * cz) * q.d;
      const numeric::Four even = q.a * (x * nx + y * ny + z * nz);
      const auto along = [&](std::size_t i, std::size_t j, numeric::Four& to) {
        to = q.b * by_f[i][m] * numeric::four(&by_f[j][n]) +
             q.c * by_cofactor[i][m] * numeric::four(&by_cofactor[j][n]);
      };
      const auto add = [&](std::size_t i, std::size_t j, const numeric::Four& block) {
        numeric::four(&sums[3 * i + j][m][n]) += q.weight * block;
      };
      numeric::Four block;
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

/// The node between two corners.
inline constexpr std::size_t middle_of[4][4] = {
    {0, 4, 6, 7}, {4, 0, 5, 8}, {6, 5, 0, 9}, {7, 8, 9, 0}};

/// What is known of a group's points.
struct GroupPoints {
  numeric::Four f[HyperelasticPoints::count]
                 [9]; ///< of the nodes' displacements, then of the bubble's, too
  numeric::Four bubble[HyperelasticPoints::count][3]; ///< its gradient
};

inline void cofactor(const numeric::Four (&f)[9], numeric::Four (&to)[9]) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t a = 3 * ((i + 1) % 3), b = 3 * ((i + 2) % 3), c = (j + 1) % 3,
                        d = (j + 2) % 3;
      to[3 * i + j] = f[a + c] * f[b + d] - f[a + d] * f[b + c];
    }
}

inline void deform(const HyperelasticPoints& points, const HyperelasticGroup& g, GroupPoints& q) {
  numeric::Four corner[4][9]; // the gradient of displacements there
  for (std::size_t k = 0; k < 4; ++k)
    for (std::size_t i = 0; i < 3; ++i) {
      numeric::Four by[4];
      for (std::size_t j = 0; j < 4; ++j)
        by[j] = j == k ? 3 * numeric::four(g.u[k][i])
                       : 4 * numeric::four(g.u[middle_of[k][j]][i]) - numeric::four(g.u[j][i]);
      for (std::size_t x = 0; x < 3; ++x)
        corner[k][3 * i + x] =
            by[0] * numeric::four(g.gradient[0][x]) + by[1] * numeric::four(g.gradient[1][x]) +
            by[2] * numeric::four(g.gradient[2][x]) + by[3] * numeric::four(g.gradient[3][x]);
    }
  for (std::size_t n = 0; n < HyperelasticPoints::count; ++n) {
    const double* const at = points.at[n];
    const double* const of = points.bubble[n];
    for (std::size_t x = 0; x < 9; ++x)
      q.f[n][x] = at[0] * corner[0][x] + at[1] * corner[1][x] + at[2] * corner[2][x] +
                  at[3] * corner[3][x] + (x % 4 == 0 ? 1.0 : 0.0);
    for (std::size_t x = 0; x < 3; ++x)
      q.bubble[n][x] =
          of[0] * numeric::four(g.gradient[0][x]) + of[1] * numeric::four(g.gradient[1][x]) +
          of[2] * numeric::four(g.gradient[2][x]) + of[3] * numeric::four(g.gradient[3][x]);
  }
}

/// Pressures of moments of J - 1.
inline void project(const numeric::Four& lambda, const numeric::Four (&moment)[4],
                    numeric::Four (&pressure)[4]) {
  const numeric::Four fifth = (moment[0] + moment[1] + moment[2] + moment[3]) / 5;
  for (std::size_t p = 0; p < 4; ++p)
    pressure[p] = 20 * lambda * (moment[p] - fifth);
}

/// What the energy of a bubble is made of at each point: I_1 and J are quadratic and linear in it.
struct GroupBubble {
  numeric::Four trace[HyperelasticPoints::count], j[HyperelasticPoints::count],
      square[HyperelasticPoints::count], along[HyperelasticPoints::count][3],
      of_j[HyperelasticPoints::count][3];
  numeric::Four moment[4], slope[4][3];
};

inline void prepare_bubble(const HyperelasticPoints& points, const GroupPoints& q, GroupBubble& b) {
  const numeric::Four none{};
  for (std::size_t p = 0; p < 4; ++p)
    b.moment[p] = b.slope[p][0] = b.slope[p][1] = b.slope[p][2] = none;
  for (std::size_t n = 0; n < HyperelasticPoints::count; ++n) {
    const numeric::Four(&f)[9] = q.f[n];
    const numeric::Four(&g)[3] = q.bubble[n];
    numeric::Four c[9];
    cofactor(f, c);
    b.trace[n] = none;
    for (std::size_t x = 0; x < 9; ++x)
      b.trace[n] += f[x] * f[x];
    b.j[n] = f[0] * c[0] + f[1] * c[1] + f[2] * c[2];
    b.square[n] = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
    for (std::size_t i = 0; i < 3; ++i) {
      b.along[n][i] = f[3 * i] * g[0] + f[3 * i + 1] * g[1] + f[3 * i + 2] * g[2];
      b.of_j[n][i] = c[3 * i] * g[0] + c[3 * i + 1] * g[1] + c[3 * i + 2] * g[2];
    }
    for (std::size_t p = 0; p < 4; ++p) {
      const double share = points.weight[n] * points.at[n][p];
      b.moment[p] += share * (b.j[n] - 1);
      for (std::size_t i = 0; i < 3; ++i)
        b.slope[p][i] += share * b.of_j[n][i];
    }
  }
}

/// The derivatives of the bubble's energy, over the volume: xx xy xz yy yz zz.
inline void bubble_system(const HyperelasticPoints& points, const GroupBubble& b,
                          const numeric::Four& mu, const numeric::Four& lambda,
                          const numeric::Four (&w)[3], numeric::Four (&gradient)[3],
                          numeric::Four (&second)[6]) {
  numeric::Four moment[4], pressure[4], turned[4], of_axis[3][4];
  for (std::size_t p = 0; p < 4; ++p)
    moment[p] = b.moment[p] + b.slope[p][0] * w[0] + b.slope[p][1] * w[1] + b.slope[p][2] * w[2];
  project(lambda, moment, pressure);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t p = 0; p < 4; ++p)
      turned[p] = b.slope[p][i];
    project(lambda, turned, of_axis[i]);
    gradient[i] = pressure[0] * b.slope[0][i] + pressure[1] * b.slope[1][i] +
                  pressure[2] * b.slope[2][i] + pressure[3] * b.slope[3][i];
  }
  std::size_t entry = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j)
      second[entry++] = of_axis[i][0] * b.slope[0][j] + of_axis[i][1] * b.slope[1][j] +
                        of_axis[i][2] * b.slope[2][j] + of_axis[i][3] * b.slope[3][j];
  const numeric::Four shear = 2.0 / 3 * mu, of_volume = 5.0 / 6 * mu;
  for (std::size_t n = 0; n < HyperelasticPoints::count; ++n) {
    const numeric::Four(&along)[3] = b.along[n];
    const numeric::Four(&of_j)[3] = b.of_j[n];
    numeric::Four now[3], trace = b.trace[n], j = b.j[n];
    for (std::size_t i = 0; i < 3; ++i) {
      now[i] = along[i] + b.square[n] * w[i];
      trace += w[i] * (along[i] + now[i]);
      j += w[i] * of_j[i];
    }
    const numeric::Four below = 1 / (trace + 1), a = points.weight[n] * 2 * shear * (1 - below),
                        curved = points.weight[n] * 4 * shear * below * below,
                        d = points.weight[n] * (of_volume * (j - 1) - mu),
                        c = points.weight[n] * of_volume, even = a * b.square[n];
    entry = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      gradient[i] += a * now[i] + d * of_j[i];
      for (std::size_t k = i; k < 3; ++k, ++entry) {
        second[entry] += curved * now[i] * now[k] + c * of_j[i] * of_j[k];
        if (k == i)
          second[entry] += even;
      }
    }
  }
}

/// Newton's method on a convex function, of each element by itself.
inline void settle_bubble(const HyperelasticPoints& points, const GroupPoints& q,
                          HyperelasticGroup& g, HyperelasticGroupResult& r) {
  constexpr int most = 12;
  constexpr double last = 1e-16; // of the energy to be gained; the step from there leaves rounding
  GroupBubble b;
  prepare_bubble(points, q, b);
  const numeric::Four mu = numeric::four(g.mu), lambda = numeric::four(g.lambda);
  numeric::Four w[3] = {numeric::four(g.bubble[0]), numeric::four(g.bubble[1]),
                        numeric::four(g.bubble[2])},
                left = mu * 0 + 1;
  for (int round = 0; round < most; ++round) {
    numeric::Four s[3], m[6];
    bubble_system(points, b, mu, lambda, w, s, m);
    const numeric::Four xx = m[3] * m[5] - m[4] * m[4], xy = m[2] * m[4] - m[1] * m[5],
                        xz = m[1] * m[4] - m[2] * m[3], yy = m[0] * m[5] - m[2] * m[2],
                        yz = m[1] * m[2] - m[0] * m[4], zz = m[0] * m[3] - m[1] * m[1],
                        over = 1 / (m[0] * xx + m[1] * xy + m[2] * xz);
    const numeric::Four by[3] = {(xx * s[0] + xy * s[1] + xz * s[2]) * over,
                                 (xy * s[0] + yy * s[1] + yz * s[2]) * over,
                                 (xz * s[0] + yz * s[1] + zz * s[2]) * over};
    const numeric::Four gain = (by[0] * s[0] + by[1] * s[1] + by[2] * s[2]) / mu;
    bool all = true;
    for (std::size_t lane = 0; lane < 4; ++lane)
      if (!(left[lane] <= last)) {
        for (std::size_t i = 0; i < 3; ++i)
          w[i][lane] -= by[i][lane];
        left[lane] = gain[lane];
        all = all && gain[lane] <= last;
      }
    if (all)
      break;
  }
  for (std::size_t i = 0; i < 3; ++i)
    numeric::four(g.bubble[i]) = w[i];
  numeric::four(r.left) = left;
}

/// Energy, and forces by their moments at the corners.
inline void respond(const HyperelasticPoints& points, bool own, const GroupPoints& q,
                    const HyperelasticGroup& g, HyperelasticGroupResult& r) {
  const numeric::Four mu = numeric::four(g.mu), lambda = numeric::four(g.lambda),
                      volume = numeric::four(g.volume), none{};
  const numeric::Four shear = 2.0 / 3 * mu, of_volume = 5.0 / 6 * mu;
  numeric::Four moment[4] = {none, none, none, none}, energy = none, j[HyperelasticPoints::count],
                trace[HyperelasticPoints::count], c[HyperelasticPoints::count][9];
  for (std::size_t k = 0; k < HyperelasticPoints::classes; ++k) {
    numeric::Four product = none + 1;
    for (std::size_t n = HyperelasticPoints::first[k]; n < HyperelasticPoints::first[k + 1]; ++n) {
      const numeric::Four(&f)[9] = q.f[n];
      cofactor(f, c[n]);
      trace[n] = none;
      for (std::size_t x = 0; x < 9; ++x)
        trace[n] += f[x] * f[x];
      j[n] = f[0] * c[n][0] + f[1] * c[n][1] + f[2] * c[n][2];
      const numeric::Four off = j[n] - 1;
      product *= (trace[n] + 1) / 4;
      energy += points.weight[n] * (shear * (trace[n] - 3) - mu * off + of_volume / 2 * off * off);
      for (std::size_t p = 0; p < 4; ++p)
        moment[p] += points.weight[n] * points.at[n][p] * off;
    }
    numeric::four(r.product[k]) = product;
  }
  numeric::Four pressure[4];
  project(lambda, moment, pressure);
  for (std::size_t p = 0; p < 4; ++p) {
    energy += pressure[p] * moment[p] / 2;
    numeric::four(r.pressure[p]) = pressure[p];
    if (own)
      pressure[p] = numeric::four(g.own[p]);
  }
  numeric::four(r.energy) = energy;
  numeric::Four at_corner[4][9], bubble[3] = {none, none, none};
  for (auto& corner : at_corner)
    for (numeric::Four& entry : corner)
      entry = none;
  for (std::size_t n = 0; n < HyperelasticPoints::count; ++n) {
    const numeric::Four a = points.weight[n] * 2 * shear * (1 - 1 / (trace[n] + 1));
    numeric::Four d = of_volume * (j[n] - 1) - mu;
    for (std::size_t p = 0; p < 4; ++p)
      d += points.at[n][p] * pressure[p];
    d = points.weight[n] * d;
    for (std::size_t x = 0; x < 9; ++x) {
      const numeric::Four stress = a * q.f[n][x] + d * c[n][x];
      bubble[x / 3] += stress * q.bubble[n][x % 3];
      for (std::size_t k = 0; k < 4; ++k)
        at_corner[k][x] += points.at[n][k] * stress;
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    numeric::Four by[4][4]; // of the gradient of j's coordinate at corner k
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t m = 0; m < 4; ++m)
        by[k][m] = volume * (at_corner[k][3 * i] * numeric::four(g.gradient[m][0]) +
                             at_corner[k][3 * i + 1] * numeric::four(g.gradient[m][1]) +
                             at_corner[k][3 * i + 2] * numeric::four(g.gradient[m][2]));
    for (std::size_t k = 0; k < 4; ++k) {
      numeric::Four force = -3 * by[k][k];
      for (std::size_t m = 0; m < 4; ++m)
        if (m != k)
          force += by[m][k];
      numeric::four(r.force[k][i]) = force;
      for (std::size_t m = k + 1; m < 4; ++m)
        numeric::four(r.force[middle_of[k][m]][i]) = -4 * (by[k][m] + by[m][k]);
    }
    numeric::four(r.force[10][i]) = -volume * bubble[i];
  }
}

inline void evaluate_group(const HyperelasticPoints& points, bool own, HyperelasticGroup& group,
                           HyperelasticGroupResult& result) {
  GroupPoints q;
  deform(points, group, q);
  if (own)
    numeric::four(result.left) = numeric::Four{};
  else
    settle_bubble(points, q, group, result);
  for (std::size_t n = 0; n < HyperelasticPoints::count; ++n)
    for (std::size_t x = 0; x < 9; ++x)
      q.f[n][x] += numeric::four(group.bubble[x / 3]) * q.bubble[n][x % 3];
  respond(points, own, q, group, result);
}

} // namespace
} // namespace gewebe::fem
