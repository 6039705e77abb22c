#pragma once
// The body of corotational_kernel_*.cpp; each of these files compiles it for one instruction set.

#include "fem/corotational_kernel_internal.h"
#include "numeric/four_lanes.h"

#include <array>
#include <cmath>

namespace gewebe::fem {
namespace {

using Whole = long long __attribute__((vector_size(32)));

/// Entries xx xy xz yy yz zz of a symmetric matrix by row and column.
inline constexpr int entry[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

/// By rows.
struct Matrix {
  numeric::Four m[9];
};
struct Symmetric {
  numeric::Four m[6];
};
struct Vector {
  numeric::Four v[3];
};

inline void gather(const double* values, const std::uint32_t* node, Vector& to) {
  const double *a = values + 3 * std::size_t{node[0]}, *b = values + 3 * std::size_t{node[1]},
               *c = values + 3 * std::size_t{node[2]}, *d = values + 3 * std::size_t{node[3]};
  for (int i = 0; i < 3; ++i)
    to.v[i] = numeric::Four{a[i], b[i], c[i], d[i]};
}

/// aᵀ b
inline void transposed_product(const Matrix& a, const Matrix& b, Matrix& c) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      c.m[3 * i + j] = a.m[i] * b.m[j] + a.m[3 + i] * b.m[3 + j] + a.m[6 + i] * b.m[6 + j];
}

/// The rotation r that makes r : f largest, of any f: of the eigenvector of Horn's matrix (Horn,
/// Closed-form solution of absolute orientation using unit quaternions, 1987) by Jacobi's method.
inline void robust_rotation(const std::array<double, 9>& f, std::array<double, 9>& r) {
  double a[4][4] = {{f[0] + f[4] + f[8], f[7] - f[5], f[2] - f[6], f[3] - f[1]},
                    {0, f[0] - f[4] - f[8], f[1] + f[3], f[2] + f[6]},
                    {0, 0, f[4] - f[0] - f[8], f[5] + f[7]},
                    {0, 0, 0, f[8] - f[0] - f[4]}};
  double q[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j)
      a[i][j] = a[j][i];
  for (int sweep = 0; sweep < 12; ++sweep)
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j) {
        if (!(std::abs(a[i][j]) > 0))
          continue;
        const double half = (a[j][j] - a[i][i]) / (2 * a[i][j]),
                     t = (half < 0 ? -1 : 1) / (std::abs(half) + std::sqrt(half * half + 1)),
                     c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (int k = 0; k < 4; ++k) {
          const double x = a[k][i], y = a[k][j];
          a[k][i] = c * x - s * y;
          a[k][j] = s * x + c * y;
        }
        for (int k = 0; k < 4; ++k) {
          const double x = a[i][k], y = a[j][k];
          a[i][k] = c * x - s * y;
          a[j][k] = s * x + c * y;
        }
        for (int k = 0; k < 4; ++k) {
          const double x = q[k][i], y = q[k][j];
          q[k][i] = c * x - s * y;
          q[k][j] = s * x + c * y;
        }
      }
  int best = 0;
  for (int i = 1; i < 4; ++i)
    if (a[i][i] > a[best][best])
      best = i;
  const double w = q[0][best], x = q[1][best], y = q[2][best], z = q[3][best];
  r = {w * w + x * x - y * y - z * z, 2 * (x * y - w * z),           2 * (x * z + w * y),
       2 * (x * y + w * z),           w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
       2 * (x * z - w * y),           2 * (y * z + w * x),           w * w - x * x - y * y + z * z};
}

/// What the rotation of f is made of: its cofactors, and invariants.
struct Invariants {
  Matrix cofactor;
  numeric::Four square, det, cofactors; ///< |f|², det f, |cof f|²
  numeric::Four t;
};

inline void invariants(const Matrix& f, Invariants& of) {
  const numeric::Four* const m = f.m;
  numeric::Four* const c = of.cofactor.m;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t k = 3 * ((i + 1) % 3), l = 3 * ((i + 2) % 3);
    c[3 * i] = m[k + 1] * m[l + 2] - m[k + 2] * m[l + 1];
    c[3 * i + 1] = m[k + 2] * m[l] - m[k] * m[l + 2];
    c[3 * i + 2] = m[k] * m[l + 1] - m[k + 1] * m[l];
  }
  of.square = m[0] * m[0];
  of.cofactors = c[0] * c[0];
  for (int k = 1; k < 9; ++k) {
    of.square += m[k] * m[k];
    of.cofactors += c[k] * c[k];
  }
  of.det = m[0] * c[0] + m[1] * c[1] + m[2] * c[2];
}

/// With s the (signed) singular values, t = Σ s is the largest root of
/// (t² - |f|²)² - 8 det f t - 4 |cof f|² = 0, convex and ascending from there on, so that Newton's
/// method comes down to it. A step of Newton's method below 1e-9 t leaves less than 1e-15 t: by its
/// curvature 12 t² over twice its slope 8 Π (s_i + s_j), except where that is so small that
/// Jacobi's method takes over. Several side by side, since each waits for its divisions.
inline void sums_of_stretches(Invariants* of, std::size_t count) {
  for (std::size_t n = 0; n < count; ++n)
    for (int l = 0; l < 4; ++l)
      of[n].t[l] = std::sqrt(3 * of[n].square[l]);
  for (int round = 0; round < 12; ++round) {
    Whole done = ~Whole{};
    for (std::size_t n = 0; n < count; ++n) {
      Invariants& o = of[n];
      const numeric::Four over = o.t * o.t - o.square,
                          step = (over * over - 8 * o.det * o.t - 4 * o.cofactors) /
                                 (4 * o.t * over - 8 * o.det),
                          t = o.t - step, most = 1e-9 * t;
      o.t = t;
      done &= (step <= most) & (-step <= most);
    }
    if ((done[0] & done[1] & done[2] & done[3]) != 0)
      return;
  }
}

/// The same as robust_rotation() of four. Cayley-Hamilton gives r without the stretch's inverse:
/// r Π (s_i + s_j) = t cof f + (t² - i) f - f fᵀ f, i = (t² - |f|²) / 2.
inline void rotation(const Matrix& f, const Invariants& of, Matrix& r) {
  const numeric::Four* const m = f.m;
  const numeric::Four t = of.t, second = 0.5 * (t * t - of.square), pairs = t * second - of.det,
                      inverse = 1 / pairs;
  Matrix right;
  transposed_product(f, f, right);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      r.m[3 * i + j] = (t * of.cofactor.m[3 * i + j] + (t * t - second) * m[3 * i + j] -
                        (m[3 * i] * right.m[j] + m[3 * i + 1] * right.m[3 + j] +
                         m[3 * i + 2] * right.m[6 + j])) *
                       inverse;
  for (int l = 0; l < 4; ++l)
    if (!(pairs[l] > 1e-3 * t[l] * t[l] * t[l])) { // nearly flat, or inverted: badly conditioned
      std::array<double, 9> one, turned;
      for (std::size_t k = 0; k < 9; ++k)
        one[k] = m[k][l];
      robust_rotation(one, turned);
      for (std::size_t k = 0; k < 9; ++k)
        r.m[k][l] = turned[k];
    }
}

/// w = (tr(s) 1 - s)⁻¹ t: how far the frame turns, per asymmetry of the deformation; 0 where that
/// isn't defined.
inline void turn_back(const Symmetric& s, const Vector& t, Vector& w) {
  const numeric::Four trace = s.m[0] + s.m[3] + s.m[5];
  const numeric::Four a = trace - s.m[0], d = trace - s.m[3], f = trace - s.m[5], b = -s.m[1],
                      c = -s.m[2], e = -s.m[4];
  const numeric::Four xx = d * f - e * e, xy = c * e - b * f, xz = b * e - c * d,
                      yy = a * f - c * c, yz = b * c - a * e, zz = a * d - b * b,
                      det = a * xx + b * xy + c * xz;
  numeric::Four inverse = 1 / det;
  for (int l = 0; l < 4; ++l)
    if (!(det[l] > 1e-6 * trace[l] * trace[l] * trace[l]))
      inverse[l] = 0;
  w.v[0] = inverse * (xx * t.v[0] + xy * t.v[1] + xz * t.v[2]);
  w.v[1] = inverse * (xy * t.v[0] + yy * t.v[1] + yz * t.v[2]);
  w.v[2] = inverse * (xz * t.v[0] + yz * t.v[1] + zz * t.v[2]);
}

/// The gradients of the shape functions at corner p (at any point of linear elements): calls
/// part(a, k, factor) for each gradient of a barycentric coordinate k that node a's is made of.
template <std::size_t Nodes, class Part>
inline void for_parts(std::size_t p, const Part& part) {
  constexpr std::size_t edges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  for (std::size_t a = 0; a < 4; ++a)
    part(a, a, Nodes == 4 ? 1.0 : a == p ? 3.0 : -1.0);
  if constexpr (Nodes == 10)
    for (std::size_t k = 0; k < 6; ++k) {
      if (edges[k][0] == p)
        part(4 + k, edges[k][1], 4.0);
      if (edges[k][1] == p)
        part(4 + k, edges[k][0], 4.0);
    }
}

/// What a group's evaluation begins with.
template <std::size_t Nodes>
struct GroupBegun {
  Matrix f[CorotationalGroup<Nodes>::points], middle; ///< deformation gradients
};

/// Of barycentric coordinates.
template <std::size_t Nodes>
inline void gradients(const CorotationalGroup<Nodes>& g, Vector (&gradient)[4]) {
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k)
      gradient[k + 1].v[i] = numeric::four(g.gradient[k][i]);
    gradient[0].v[i] = -(gradient[1].v[i] + gradient[2].v[i] + gradient[3].v[i]);
  }
}

template <std::size_t Nodes>
inline void begin_group(const CorotationalGroup<Nodes>& g, const double* x,
                        GroupBegun<Nodes>& begun) {
  constexpr std::size_t points = CorotationalGroup<Nodes>::points;
  Vector gradient[4], at[Nodes], first;
  gradients(g, gradient);
  gather(x, g.node[0], first);
  for (std::size_t a = 0; a < Nodes; ++a) {
    gather(x, g.node[a], at[a]);
    for (int i = 0; i < 3; ++i)
      at[a].v[i] -= first.v[i]; // for less rounding
  }
  Matrix(&f)[points] = begun.f;
  for (std::size_t p = 0; p < points; ++p) {
    for (numeric::Four& m : f[p].m)
      m = numeric::Four{};
    for_parts<Nodes>(p, [&](std::size_t a, std::size_t k, double factor) {
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          f[p].m[3 * i + j] += at[a].v[i] * gradient[k].v[j] * factor;
    });
  }
  for (int k = 0; k < 9; ++k) {
    begun.middle.m[k] = f[0].m[k];
    for (std::size_t p = 1; p < points; ++p)
      begun.middle.m[k] += f[p].m[k];
    begun.middle.m[k] *= 1.0 / points;
  }
}

template <std::size_t Nodes>
void end_group(const CorotationalGroup<Nodes>& g, const GroupBegun<Nodes>& begun,
               const Invariants& of, const CorotationalStrains<Nodes>* before,
               const CorotationalWeights& weights, CorotationalResult<Nodes>& result,
               CorotationalStrains<Nodes>* strains) {
  constexpr std::size_t points = CorotationalGroup<Nodes>::points;
  const numeric::Four volume = numeric::four(g.volume), mu = numeric::four(g.mu),
                      lambda = numeric::four(g.lambda);
  const Matrix(&f)[points] = begun.f;
  const Matrix& middle = begun.middle;
  Vector gradient[4];
  gradients(g, gradient);
  Matrix r;
  rotation(middle, of, r);

  // Strains and stresses.
  Matrix turned[points];
  Symmetric stress[points];
  Symmetric now[points];
  const auto stress_of = [&](const Symmetric& e, Symmetric& s) {
    const numeric::Four volumetric = lambda * (e.m[0] + e.m[3] + e.m[5]);
    for (int k = 0; k < 6; ++k)
      s.m[k] = 2 * mu * e.m[k] + (k == 0 || k == 3 || k == 5 ? volumetric : numeric::Four{});
  };
  for (std::size_t p = 0; p < points; ++p) {
    transposed_product(r, f[p], turned[p]);
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j)
        now[p].m[entry[i][j]] =
            0.5 * (turned[p].m[3 * i + j] + turned[p].m[3 * j + i]) - (i == j ? 1 : 0);
    for (std::size_t k = 0; strains != nullptr && k < 6; ++k)
      numeric::four(strains->value[6 * p + k]) = now[p].m[k];
  }
  // The energy of strains e, and its derivative by them; the bubble eliminated.
  const auto work = [&](const Symmetric(&e)[points], Symmetric(&force)[points]) {
    Symmetric s[points], total;
    for (std::size_t p = 0; p < points; ++p)
      stress_of(e[p], s[p]);
    if constexpr (Nodes == 4) {
      force[0] = s[0];
      for (numeric::Four& m : force[0].m)
        m *= volume;
    } else {
      Vector divergence, w;
      for (int k = 0; k < 6; ++k)
        total.m[k] = s[0].m[k] + s[1].m[k] + s[2].m[k] + s[3].m[k];
      for (int i = 0; i < 3; ++i) {
        divergence.v[i] = numeric::Four{};
        for (std::size_t p = 0; p < points; ++p)
          for (int j = 0; j < 3; ++j)
            divergence.v[i] += s[p].m[entry[i][j]] * gradient[p].v[j];
      }
      for (int i = 0; i < 3; ++i) {
        w.v[i] = numeric::Four{};
        for (int j = 0; j < 3; ++j)
          w.v[i] += numeric::four(g.flexibility[entry[i][j]]) * divergence.v[j];
      }
      for (std::size_t p = 0; p < points; ++p) {
        Symmetric slope, handed;
        for (int i = 0; i < 3; ++i)
          for (int j = i; j < 3; ++j)
            slope.m[entry[i][j]] = 0.5 * (w.v[i] * gradient[p].v[j] + w.v[j] * gradient[p].v[i]);
        stress_of(slope, handed);
        for (int k = 0; k < 6; ++k)
          force[p].m[k] = volume * 0.05 * (s[p].m[k] + total.m[k]) - handed.m[k];
      }
    }
    numeric::Four twice = numeric::Four{};
    for (std::size_t p = 0; p < points; ++p)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          twice += force[p].m[entry[i][j]] * e[p].m[entry[i][j]];
    return Symmetric{{0.5 * twice}}; // its first entry; a vector would be returned by another rule
  };
  if (weights.damping == 0) {
    numeric::four(result.elastic) = work(now, stress).m[0];
    numeric::four(result.damping) = numeric::Four{};
    for (std::size_t p = 0; p < points; ++p)
      for (numeric::Four& m : stress[p].m)
        m *= weights.elastic;
  } else {
    Symmetric change[points], of_change[points];
    for (std::size_t p = 0; p < points; ++p)
      for (std::size_t k = 0; k < 6; ++k)
        change[p].m[k] = now[p].m[k] - numeric::four(before->value[6 * p + k]);
    numeric::four(result.elastic) = work(now, stress).m[0];
    numeric::four(result.damping) = work(change, of_change).m[0];
    for (std::size_t p = 0; p < points; ++p)
      for (int k = 0; k < 6; ++k)
        stress[p].m[k] = stress[p].m[k] * weights.elastic + of_change[p].m[k] * weights.damping;
  }

  // The frame turns with the middle: what the stresses do by that goes back on it.
  Vector moment, back;
  for (numeric::Four& m : moment.v)
    m = numeric::Four{};
  for (std::size_t p = 0; p < points; ++p) {
    const numeric::Four* const a = turned[p].m;
    const numeric::Four* const s = stress[p].m;
    const auto entry_of = [&](std::size_t i, std::size_t j,
                              numeric::Four& to) { // of turned · stress
      to =
          a[3 * i] * s[entry[0][j]] + a[3 * i + 1] * s[entry[1][j]] + a[3 * i + 2] * s[entry[2][j]];
    };
    numeric::Four one, other;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      entry_of(i, j, one);
      entry_of(j, i, other);
      moment.v[k] += one - other;
    }
  }
  Symmetric stretch;
  transposed_product(r, middle, turned[0]);
  for (int i = 0; i < 3; ++i)
    for (int j = i; j < 3; ++j)
      stretch.m[entry[i][j]] = 0.5 * (turned[0].m[3 * i + j] + turned[0].m[3 * j + i]);
  turn_back(stretch, moment, back);

  for (std::size_t k = 0; k < 3 * Nodes; ++k)
    numeric::four(result.force[k]) = numeric::Four{};
  for (std::size_t p = 0; p < points; ++p) {
    Matrix local, acts;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        local.m[3 * i + j] = stress[p].m[entry[i][j]];
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      local.m[3 * j + i] -= back.v[k] * (1.0 / points);
      local.m[3 * i + j] += back.v[k] * (1.0 / points);
    }
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        acts.m[3 * i + j] = r.m[3 * i] * local.m[j] + r.m[3 * i + 1] * local.m[3 + j] +
                            r.m[3 * i + 2] * local.m[6 + j];
    Vector along[4];
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t i = 0; i < 3; ++i)
        along[k].v[i] = acts.m[3 * i] * gradient[k].v[0] + acts.m[3 * i + 1] * gradient[k].v[1] +
                        acts.m[3 * i + 2] * gradient[k].v[2];
    for_parts<Nodes>(p, [&](std::size_t a, std::size_t k, double factor) {
      for (std::size_t i = 0; i < 3; ++i)
        numeric::four(result.force[3 * a + i]) -= along[k].v[i] * factor;
    });
  }
  for (int k = 0; k < 9; ++k)
    numeric::four(result.rotation.value[k]) = r.m[k];
}

/// Four vectors, by lanes in place of by entries.
inline void transpose(const numeric::Four (&rows)[4], numeric::Four (&lanes)[4]) {
  const numeric::Four a = __builtin_shufflevector(rows[0], rows[1], 0, 4, 2, 6),
                      b = __builtin_shufflevector(rows[0], rows[1], 1, 5, 3, 7),
                      c = __builtin_shufflevector(rows[2], rows[3], 0, 4, 2, 6),
                      d = __builtin_shufflevector(rows[2], rows[3], 1, 5, 3, 7);
  lanes[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  lanes[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  lanes[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  lanes[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

/// Adds a group's results to the sums of its nodes.
template <std::size_t Nodes>
inline void add_group(const CorotationalGroup<Nodes>& g, const CorotationalResult<Nodes>& result,
                      const CorotationalPlaces<Nodes>& places, bool turns, double* sums) {
  const std::size_t width = turns ? corotational_turned : corotational_force;
  const numeric::Four volume = numeric::four(g.volume);
  numeric::Four rows[4], force[4], first[4], rest[4];
  if (turns) {
    for (int k = 0; k < 4; ++k)
      rows[k] = volume * numeric::four(result.rotation.value[1 + k]);
    transpose(rows, first);
    for (int k = 0; k < 4; ++k)
      rows[k] = volume * numeric::four(result.rotation.value[5 + k]);
    transpose(rows, rest);
  }
  for (std::size_t a = 0; a < Nodes; ++a) {
    for (std::size_t i = 0; i < 3; ++i)
      rows[i] = numeric::four(result.force[3 * a + i]);
    rows[3] = volume * numeric::four(result.rotation.value[0]);
    transpose(rows, force);
    for (std::size_t lane = 0; lane < 4; ++lane) {
      double* const to = sums + width * places[a][lane];
      numeric::four(to) += force[lane];
      if (turns) {
        numeric::four(to + 4) += first[lane];
        numeric::four(to + 8) += rest[lane];
      }
    }
  }
}

template <std::size_t Nodes>
void evaluate(const CorotationalGroup<Nodes>* groups, std::size_t count,
              const CorotationalTask<Nodes>& task, CorotationalResult<Nodes>* results) {
  GroupBegun<Nodes> begun[corotational_together];
  Invariants of[corotational_together];
  for (std::size_t n = 0; n < count; ++n) {
    begin_group<Nodes>(groups[n], task.x, begun[n]);
    invariants(begun[n].middle, of[n]);
  }
  sums_of_stretches(of, count);
  for (std::size_t n = 0; n < count; ++n) {
    end_group<Nodes>(groups[n], begun[n], of[n], task.before == nullptr ? nullptr : task.before + n,
                     task.weights, results[n],
                     task.strains == nullptr ? nullptr : task.strains + n);
    add_group<Nodes>(groups[n], results[n], task.places[n], task.turns, task.sums);
  }
}

inline void turn(double (*matrices)[4], std::size_t count) {
  Matrix f[corotational_together], r;
  Invariants of[corotational_together];
  for (std::size_t begin = 0; begin < count; begin += corotational_together) {
    const std::size_t together =
        count - begin < corotational_together ? count - begin : corotational_together;
    for (std::size_t n = 0; n < together; ++n) {
      for (std::size_t k = 0; k < 9; ++k)
        f[n].m[k] = numeric::four(matrices[9 * (begin + n) + k]);
      invariants(f[n], of[n]);
    }
    sums_of_stretches(of, together);
    for (std::size_t n = 0; n < together; ++n) {
      rotation(f[n], of[n], r);
      for (std::size_t k = 0; k < 9; ++k)
        numeric::four(matrices[9 * (begin + n) + k]) = r.m[k];
    }
  }
}

} // namespace
} // namespace gewebe::fem
