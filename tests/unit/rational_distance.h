#pragma once
// Distances of points, edges and triangles by rational numbers: exact.

#include "geometry/vec3.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <gmpxx.h>

namespace gewebe::test {

using Number = mpq_class;
using Vector = std::array<Number, 3>;
using ExactQuad = std::array<Vector, 4>;

inline Vector exact(const Vec3& p) {
  return {Number(p.x), Number(p.y), Number(p.z)};
}
inline ExactQuad exact(const std::array<Vec3, 4>& x) {
  return {exact(x[0]), exact(x[1]), exact(x[2]), exact(x[3])};
}
inline Vector minus(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vector along(const Vector& a, const Number& t, const Vector& d) {
  return {a[0] + t * d[0], a[1] + t * d[1], a[2] + t * d[2]};
}
inline Number dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline Number squared(const Vector& a) {
  return dot(a, a);
}

/// Squared distance of a point and a segment.
inline Number to_segment(const Vector& p, const Vector& a, const Vector& b) {
  const Vector e = minus(b, a);
  const Number length = squared(e);
  Number t = 0;
  if (length > 0) {
    t = dot(minus(p, a), e) / length;
    if (t < 0)
      t = 0;
    if (t > 1)
      t = 1;
  }
  return squared(minus(p, along(a, t, e)));
}

/// Squared distance of the edges 0 1 and 2 3.
inline Number of_edges(const ExactQuad& x) {
  Number least = std::min({to_segment(x[0], x[2], x[3]), to_segment(x[1], x[2], x[3]),
                           to_segment(x[2], x[0], x[1]), to_segment(x[3], x[0], x[1])});
  const Vector u = minus(x[1], x[0]), v = minus(x[3], x[2]), n = cross(u, v), w = minus(x[2], x[0]);
  const Number square = squared(n);
  if (square > 0) {
    const Number s = dot(cross(w, v), n), t = dot(cross(w, u), n);
    if (s >= 0 && s <= square && t >= 0 && t <= square) {
      const Number height = dot(w, n);
      const Number d = height * height / square;
      return std::min(least, d);
    }
  }
  return least;
}

/// Squared distance of the point 0 and the triangle 1 2 3.
inline Number of_triangle(const ExactQuad& x) {
  Number least = std::min(
      {to_segment(x[0], x[1], x[2]), to_segment(x[0], x[2], x[3]), to_segment(x[0], x[3], x[1])});
  const Vector n = cross(minus(x[2], x[1]), minus(x[3], x[1]));
  const Number square = squared(n);
  if (square > 0) {
    const auto inside = [&](std::size_t a, std::size_t b) {
      return dot(cross(minus(x[b], x[a]), minus(x[0], x[a])), n) >= 0;
    };
    if (inside(1, 2) && inside(2, 3) && inside(3, 1)) {
      const Number height = dot(minus(x[0], x[1]), n);
      const Number d = height * height / square;
      return std::min(least, d);
    }
  }
  return least;
}

} // namespace gewebe::test
