#pragma once
// The body of warp_kernel_*.cpp; each of these files compiles it for one instruction set.

#include "numeric/four_lanes.h"
#include "statics/warp_kernel_internal.h"

namespace gewebe::statics {
namespace {

struct Vector {
  numeric::Four x, y, z;
};
/// By rows.
struct Matrix {
  Vector row[3];
};

inline void gather(const double* values, const std::uint32_t* node, Vector& to) {
  const double *a = values + 3 * std::size_t{node[0]}, *b = values + 3 * std::size_t{node[1]},
               *c = values + 3 * std::size_t{node[2]}, *d = values + 3 * std::size_t{node[3]};
  to.x = numeric::Four{a[0], b[0], c[0], d[0]};
  to.y = numeric::Four{a[1], b[1], c[1], d[1]};
  to.z = numeric::Four{a[2], b[2], c[2], d[2]};
}

inline void scatter(const Vector& v, const std::uint32_t* node, double* values) {
  for (int lane = 0; lane < 4; ++lane) {
    double* const at = values + 3 * std::size_t{node[lane]};
    at[0] += v.x[lane];
    at[1] += v.y[lane];
    at[2] += v.z[lane];
  }
}

inline void cross(const Vector& a, const Vector& b, Vector& c) {
  c.x = a.y * b.z - a.z * b.y;
  c.y = a.z * b.x - a.x * b.z;
  c.z = a.x * b.y - a.y * b.x;
}

inline void load(const double (*from)[4], Vector& to) {
  to.x = numeric::four(from[0]);
  to.y = numeric::four(from[1]);
  to.z = numeric::four(from[2]);
}

/// The gradient of values at the triangles' nodes, along them.
inline void along(const TriangleGroup& t, const double* values, Matrix& m) {
  Vector v[3], g, h;
  for (int k = 0; k < 3; ++k)
    gather(values, t.node[k], v[k]);
  load(t.gradient[0], g);
  load(t.gradient[1], h);
  const numeric::Four b[3]{v[1].x - v[0].x, v[1].y - v[0].y, v[1].z - v[0].z},
      c[3]{v[2].x - v[0].x, v[2].y - v[0].y, v[2].z - v[0].z};
  for (int i = 0; i < 3; ++i) {
    m.row[i].x = b[i] * g.x + c[i] * h.x;
    m.row[i].y = b[i] * g.y + c[i] * h.y;
    m.row[i].z = b[i] * g.z + c[i] * h.z;
  }
}

/// Adds area m ∇N of each node.
inline void add_divergence(const TriangleGroup& t, const Matrix& m, double* sum) {
  const numeric::Four area = numeric::four(t.area);
  Vector part[2], first;
  for (int k = 0; k < 2; ++k) {
    Vector g;
    load(t.gradient[k], g);
    const auto along_row = [&](const Vector& r, numeric::Four& to) {
      to = (r.x * g.x + r.y * g.y + r.z * g.z) * area;
    };
    along_row(m.row[0], part[k].x);
    along_row(m.row[1], part[k].y);
    along_row(m.row[2], part[k].z);
  }
  first.x = -(part[0].x + part[1].x);
  first.y = -(part[0].y + part[1].y);
  first.z = -(part[0].z + part[1].z);
  scatter(first, t.node[0], sum);
  scatter(part[0], t.node[1], sum);
  scatter(part[1], t.node[2], sum);
}

/// (1 - cos a) / a² and (a - sin a) / a³ of the angle a, by its square.
inline void angle_terms(const numeric::Four& square, numeric::Four& second, numeric::Four& third) {
  second = third = numeric::Four{};
  constexpr int terms = 10;
  static constexpr double even[terms]{1.0 / 2,   1.0 / 12,  1.0 / 30,  1.0 / 56,  1.0 / 90,
                                      1.0 / 132, 1.0 / 182, 1.0 / 240, 1.0 / 306, 1.0 / 380},
      odd[terms]{1.0 / 6,   1.0 / 20,  1.0 / 42,  1.0 / 72,  1.0 / 110,
                 1.0 / 156, 1.0 / 210, 1.0 / 272, 1.0 / 342, 1.0 / 420};
  for (int k = terms - 1; k >= 0; --k) {
    second = (1 - square * second) * even[k];
    third = (1 - square * third) * odd[k];
  }
}

/// R of the frames' w, E of displacements, and what is in the frames: I + E + E² / 2 + [r], where r
/// is the rotation beyond w.
struct State {
  Vector w;
  numeric::Four second, third; ///< (1 - cos a) / a², (a - sin a) / a³ of the angle a
  Matrix strain, rotation, inside;
};

/// The gradient of displacements.
inline void gradient(const TriangleGroup& t, const double* local, Matrix& h) {
  along(t, local, h);
  Vector n;
  load(t.normal, n);
  // The normal turns with the surface.
  Vector tilt;
  tilt.x = n.x * h.row[0].x + n.y * h.row[1].x + n.z * h.row[2].x;
  tilt.y = n.x * h.row[0].y + n.y * h.row[1].y + n.z * h.row[2].y;
  tilt.z = n.x * h.row[0].z + n.y * h.row[1].z + n.z * h.row[2].z;
  const auto turn = [&](const numeric::Four& of, Vector& row) {
    row.x -= of * n.x;
    row.y -= of * n.y;
    row.z -= of * n.z;
  };
  turn(tilt.x, h.row[0]);
  turn(tilt.y, h.row[1]);
  turn(tilt.z, h.row[2]);
}

/// Half of the curl.
inline void rotation_of(const Matrix& h, Vector& w) {
  w.x = 0.5 * (h.row[2].y - h.row[1].z);
  w.y = 0.5 * (h.row[0].z - h.row[2].x);
  w.z = 0.5 * (h.row[1].x - h.row[0].y);
}

/// Four vectors, one behind the other.
inline void gather(const double* values, Vector& to) {
  to.x = numeric::Four{values[0], values[3], values[6], values[9]};
  to.y = numeric::Four{values[1], values[4], values[7], values[10]};
  to.z = numeric::Four{values[2], values[5], values[8], values[11]};
}

inline void put(const Vector& v, double* to) {
  for (std::size_t lane = 0; lane < 4; ++lane) {
    to[3 * lane] = v.x[lane];
    to[3 * lane + 1] = v.y[lane];
    to[3 * lane + 2] = v.z[lane];
  }
}

/// \param w of the frames
inline void state(const TriangleGroup& t, const double* local, const double* w, State& s) {
  Matrix h;
  gradient(t, local, h);
  gather(w, s.w);
  Vector beyond;
  rotation_of(h, beyond);
  beyond.x -= s.w.x;
  beyond.y -= s.w.y;
  beyond.z -= s.w.z;
  Matrix& e = s.strain;
  e.row[0].x = h.row[0].x;
  e.row[1].y = h.row[1].y;
  e.row[2].z = h.row[2].z;
  e.row[0].y = e.row[1].x = 0.5 * (h.row[0].y + h.row[1].x);
  e.row[0].z = e.row[2].x = 0.5 * (h.row[0].z + h.row[2].x);
  e.row[1].z = e.row[2].y = 0.5 * (h.row[1].z + h.row[2].y);

  const numeric::Four xx = s.w.x * s.w.x, yy = s.w.y * s.w.y, zz = s.w.z * s.w.z,
                      square = xx + yy + zz;
  angle_terms(square, s.second, s.third);
  const numeric::Four first = 1 - square * s.third, diagonal = 1 - square * s.second,
                      xy = s.second * s.w.x * s.w.y, xz = s.second * s.w.x * s.w.z,
                      yz = s.second * s.w.y * s.w.z;
  Matrix& r = s.rotation;
  r.row[0].x = diagonal + s.second * xx;
  r.row[1].y = diagonal + s.second * yy;
  r.row[2].z = diagonal + s.second * zz;
  r.row[0].y = xy - first * s.w.z;
  r.row[1].x = xy + first * s.w.z;
  r.row[0].z = xz + first * s.w.y;
  r.row[2].x = xz - first * s.w.y;
  r.row[1].z = yz - first * s.w.x;
  r.row[2].y = yz + first * s.w.x;

  Matrix& u = s.inside;
  const Vector *a = e.row, &p = a[0], &q = a[1], &o = a[2];
  u.row[0].x = 1 + p.x + 0.5 * (p.x * p.x + p.y * p.y + p.z * p.z);
  u.row[1].y = 1 + q.y + 0.5 * (q.x * q.x + q.y * q.y + q.z * q.z);
  u.row[2].z = 1 + o.z + 0.5 * (o.x * o.x + o.y * o.y + o.z * o.z);
  const numeric::Four pq = p.y + 0.5 * (p.x * q.x + p.y * q.y + p.z * q.z),
                      po = p.z + 0.5 * (p.x * o.x + p.y * o.y + p.z * o.z),
                      qo = q.z + 0.5 * (q.x * o.x + q.y * o.y + q.z * o.z);
  u.row[0].y = pq - beyond.z;
  u.row[1].x = pq + beyond.z;
  u.row[0].z = po + beyond.y;
  u.row[2].x = po - beyond.y;
  u.row[1].z = qo - beyond.x;
  u.row[2].y = qo + beyond.x;
}

/// a b
inline void product(const Matrix& a, const Matrix& b, Matrix& c) {
  for (int i = 0; i < 3; ++i) {
    c.row[i].x = a.row[i].x * b.row[0].x + a.row[i].y * b.row[1].x + a.row[i].z * b.row[2].x;
    c.row[i].y = a.row[i].x * b.row[0].y + a.row[i].y * b.row[1].y + a.row[i].z * b.row[2].y;
    c.row[i].z = a.row[i].x * b.row[0].z + a.row[i].y * b.row[1].z + a.row[i].z * b.row[2].z;
  }
}

inline void find_rotations(const TriangleGroup* groups, std::size_t count, const double* local,
                           double* w) {
  for (std::size_t n = 0; n < count; ++n) {
    Matrix h;
    Vector v;
    gradient(groups[n], local, h);
    rotation_of(h, v);
    put(v, w + 12 * n);
  }
}

inline void ask(const TriangleGroup* groups, std::size_t count, const double* local,
                const double* w, double* divergence) {
  for (std::size_t n = 0; n < count; ++n) {
    State s;
    state(groups[n], local, w + 12 * n, s);
    Matrix wanted;
    product(s.rotation, s.inside, wanted);
    wanted.row[0].x -= 1;
    wanted.row[1].y -= 1;
    wanted.row[2].z -= 1;
    add_divergence(groups[n], wanted, divergence);
  }
}

inline void turn_middles(const MiddleGroup* groups, std::size_t count, const double* w,
                         const double* local, double* u) {
  for (std::size_t n = 0; n < count; ++n) {
    const MiddleGroup& g = groups[n];
    Vector first, last, mean, off, end, once, twice, at_a, at_b;
    gather(w, g.triangle[0], first);
    gather(w, g.triangle[1], last);
    mean.x = 0.5 * (first.x + last.x);
    mean.y = 0.5 * (first.y + last.y);
    mean.z = 0.5 * (first.z + last.z);
    gather(local, g.node, off);
    gather(local, g.a, first);
    gather(local, g.b, end);
    off.x -= 0.5 * (first.x + end.x);
    off.y -= 0.5 * (first.y + end.y);
    off.z -= 0.5 * (first.z + end.z);
    numeric::Four second, third;
    const numeric::Four square = mean.x * mean.x + mean.y * mean.y + mean.z * mean.z;
    angle_terms(square, second, third);
    const numeric::Four sine = 1 - square * third;
    cross(mean, off, once);
    cross(mean, once, twice);
    gather(u, g.a, at_a);
    gather(u, g.b, at_b);
    const numeric::Four x = numeric::four(g.free[0]) *
                            (0.5 * (at_a.x + at_b.x) + off.x + sine * once.x + second * twice.x),
                        y = numeric::four(g.free[1]) *
                            (0.5 * (at_a.y + at_b.y) + off.y + sine * once.y + second * twice.y),
                        z = numeric::four(g.free[2]) *
                            (0.5 * (at_a.z + at_b.z) + off.z + sine * once.z + second * twice.z);
    for (int lane = 0; lane < 4; ++lane) {
      double* const to = u + 3 * std::size_t{g.node[lane]};
      to[0] = x[lane];
      to[1] = y[lane];
      to[2] = z[lane];
    }
  }
}

/// Rᵀ ∇y: what acts in the frames.
inline void in_frames(const TriangleGroup& t, const State& s, const double* y, Matrix& back) {
  Matrix slope, turned;
  along(t, y, slope);
  for (int i = 0; i < 3; ++i) { // Rᵀ
    const Vector* const r = s.rotation.row;
    turned.row[i].x = i == 0 ? r[0].x : i == 1 ? r[0].y : r[0].z;
    turned.row[i].y = i == 0 ? r[1].x : i == 1 ? r[1].y : r[1].z;
    turned.row[i].z = i == 0 ? r[2].x : i == 1 ? r[2].y : r[2].z;
  }
  product(turned, slope, back);
}

inline void find_moments(const TriangleGroup* groups, std::size_t count, const double* local,
                         const double* w, const double* y, double* moments) {
  for (std::size_t n = 0; n < count; ++n) {
    State s;
    state(groups[n], local, w + 12 * n, s);
    // Of F = R S, dF = R [v] S + R dS with v = dw - second w × dw + third w × (w × dw), and
    // dS = - [dw] among others.
    Matrix back;
    in_frames(groups[n], s, y, back);
    const auto across = [](const Vector& a, const Vector& b, const Vector& c, const Vector& d,
                           numeric::Four& to) {
      to = (a.x * b.x + a.y * b.y + a.z * b.z) - (c.x * d.x + c.y * d.y + c.z * d.z);
    };
    const Vector *b = back.row, *u = s.inside.row;
    Vector moment, once, twice;
    across(b[2], u[1], b[1], u[2], moment.x);
    across(b[0], u[2], b[2], u[0], moment.y);
    across(b[1], u[0], b[0], u[1], moment.z);
    cross(s.w, moment, once);
    cross(s.w, once, twice);
    moment.x += once.x * s.second + twice.x * s.third - (b[2].y - b[1].z);
    moment.y += once.y * s.second + twice.y * s.third - (b[0].z - b[2].x);
    moment.z += once.z * s.second + twice.z * s.third - (b[1].x - b[0].y);
    put(moment, moments + 12 * n);
  }
}

inline void take_back(const TriangleGroup* groups, std::size_t count, const double* local,
                      const double* w, const double* y, const double* moments, double* forces) {
  for (std::size_t n = 0; n < count; ++n) {
    const TriangleGroup& t = groups[n];
    State s;
    state(t, local, w + 12 * n, s);
    Matrix back;
    in_frames(t, s, y, back);
    Vector half;
    gather(moments + 12 * n, half);
    half.x = 0.5 * (half.x + back.row[2].y - back.row[1].z);
    half.y = 0.5 * (half.y + back.row[0].z - back.row[2].x);
    half.z = 0.5 * (half.z + back.row[1].x - back.row[0].y);

    Matrix even, m;
    even.row[0].x = back.row[0].x;
    even.row[1].y = back.row[1].y;
    even.row[2].z = back.row[2].z;
    even.row[0].y = even.row[1].x = 0.5 * (back.row[0].y + back.row[1].x);
    even.row[0].z = even.row[2].x = 0.5 * (back.row[0].z + back.row[2].x);
    even.row[1].z = even.row[2].y = 0.5 * (back.row[1].z + back.row[2].y);
    Matrix strained;
    product(even, s.strain, strained);
    const numeric::Four xy = even.row[0].y + 0.5 * (strained.row[0].y + strained.row[1].x),
                        xz = even.row[0].z + 0.5 * (strained.row[0].z + strained.row[2].x),
                        yz = even.row[1].z + 0.5 * (strained.row[1].z + strained.row[2].y);
    m.row[0].x = even.row[0].x + strained.row[0].x;
    m.row[1].y = even.row[1].y + strained.row[1].y;
    m.row[2].z = even.row[2].z + strained.row[2].z;
    m.row[0].y = xy - half.z;
    m.row[1].x = xy + half.z;
    m.row[0].z = xz + half.y;
    m.row[2].x = xz - half.y;
    m.row[1].z = yz - half.x;
    m.row[2].y = yz + half.x;
    // The normal turns with the surface.
    Vector normal;
    load(t.normal, normal);
    numeric::Four along_normal[3];
    for (int i = 0; i < 3; ++i)
      along_normal[i] = m.row[i].x * normal.x + m.row[i].y * normal.y + m.row[i].z * normal.z;
    const numeric::Four of_row[3]{normal.x, normal.y, normal.z};
    for (int i = 0; i < 3; ++i) {
      m.row[i].x -= of_row[i] * along_normal[0];
      m.row[i].y -= of_row[i] * along_normal[1];
      m.row[i].z -= of_row[i] * along_normal[2];
    }
    add_divergence(t, m, forces);
  }
}

/// The first `Width` of the columns.
template <int Width>
void combine_some(const float* columns, std::size_t stride, std::size_t rows, const double* factor,
                  double* sum) {
  std::size_t k = 0;
  for (; k + 4 <= rows; k += 4) {
    numeric::Four total = numeric::four(sum + k), entry;
    for (int c = 0; c < Width; ++c) {
      numeric::load(columns + static_cast<std::size_t>(c) * stride + k, entry);
      total += entry * factor[c];
    }
    numeric::four(sum + k) = total;
  }
  for (; k < rows; ++k)
    for (int c = 0; c < Width; ++c)
      sum[k] += static_cast<double>(columns[static_cast<std::size_t>(c) * stride + k]) * factor[c];
}

inline void combine(const float* columns, std::size_t stride, std::size_t rows,
                    const double* factor, std::size_t count, double* sum) {
  for (std::size_t k = 0; k < rows; ++k)
    sum[k] = 0;
  std::size_t c = 0;
  for (; c + 6 <= count; c += 6)
    combine_some<6>(columns + c * stride, stride, rows, factor + c, sum);
  for (; c < count; ++c)
    combine_some<1>(columns + c * stride, stride, rows, factor + c, sum);
}

template <int Width>
void project_some(const float* columns, std::size_t stride, std::size_t rows, const double* by,
                  double* product) {
  numeric::Four sums[Width]{}, entry;
  std::size_t k = 0;
  for (; k + 4 <= rows; k += 4)
    for (int c = 0; c < Width; ++c) {
      numeric::load(columns + static_cast<std::size_t>(c) * stride + k, entry);
      sums[c] += entry * numeric::four(by + k);
    }
  for (int c = 0; c < Width; ++c) {
    double rest = 0;
    for (std::size_t r = k; r < rows; ++r)
      rest += static_cast<double>(columns[static_cast<std::size_t>(c) * stride + r]) * by[r];
    product[c] = (sums[c][0] + sums[c][1]) + (sums[c][2] + sums[c][3]) + rest;
  }
}

inline void project(const float* columns, std::size_t stride, std::size_t rows, const double* by,
                    std::size_t count, double* product) {
  std::size_t c = 0;
  for (; c + 6 <= count; c += 6)
    project_some<6>(columns + c * stride, stride, rows, by, product + c);
  for (; c < count; ++c)
    project_some<1>(columns + c * stride, stride, rows, by, product + c);
}

} // namespace
} // namespace gewebe::statics
