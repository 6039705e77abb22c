#pragma once
// Proof that all dihedral angles of a tetrahedron keep bounds while its corners are anywhere on
// segments. What is known of a dihedral angle at edge AB between the faces with C and D makes it
// finite:
// - Seen along AB, a point that moves along a line turns one way only. So over the places of C and
//   D the angle is largest and least at the ends of their ranges.
// - The normals of the faces are bilinear in the places of A and B on their ranges, and cos² and
//   its bound times the lengths are polynomials of degree 4 in each. Their Bernstein coefficients
//   bound them from below; halves of the square are looked at until the bound decides.

#include "geometry/vec3.h"
#include "tests/unit/larger.h"
#include "tetrahedra/tet_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace gewebe::angle_bounds {

/// A polynomial in Bernstein form on the unit square, of degree N in each variable.
template <std::size_t N>
struct Bernstein {
  std::array<std::array<double, N + 1>, N + 1> c{};
};

/// Binomial coefficients up to 4.
inline constexpr std::array<std::array<double, 5>, 5> choose{
    {{1, 0, 0, 0, 0}, {1, 1, 0, 0, 0}, {1, 2, 1, 0, 0}, {1, 3, 3, 1, 0}, {1, 4, 6, 4, 1}}};

template <std::size_t N, std::size_t M>
Bernstein<N + M> product(const Bernstein<N>& a, const Bernstein<M>& b) {
  Bernstein<N + M> result;
  for (std::size_t i = 0; i <= N; ++i)
    for (std::size_t j = 0; j <= N; ++j)
      for (std::size_t k = 0; k <= M; ++k)
        for (std::size_t l = 0; l <= M; ++l)
          result.c[i + k][j + l] += a.c[i][j] * b.c[k][l] * choose[N][i] * choose[N][j] *
                                    choose[M][k] * choose[M][l] /
                                    (choose[N + M][i + k] * choose[N + M][j + l]);
  return result;
}

/// a factor - b
template <std::size_t N>
Bernstein<N> weighted_difference(double factor, const Bernstein<N>& a, const Bernstein<N>& b) {
  Bernstein<N> result;
  for (std::size_t i = 0; i <= N; ++i)
    for (std::size_t j = 0; j <= N; ++j)
      result.c[i][j] = factor * a.c[i][j] - b.c[i][j];
  return result;
}

template <std::size_t N>
double least(const Bernstein<N>& a) {
  double result = HUGE_VAL;
  for (const auto& row : a.c)
    for (const double value : row)
      result = test::smaller(result, value);
  return result;
}

/// What is left of the first variable's middle, or right of it (de Casteljau); then the variables
/// change places, so that the next half is one of the other.
template <std::size_t N>
Bernstein<N> half(Bernstein<N> a, bool right) {
  if (right)
    std::reverse(a.c.begin(), a.c.end());
  Bernstein<N> result;
  for (std::size_t level = 0; level <= N; ++level) {
    for (std::size_t j = 0; j <= N; ++j)
      result.c[j][right ? N - level : level] = a.c[0][j];
    for (std::size_t i = 0; i + level < N; ++i)
      for (std::size_t j = 0; j <= N; ++j)
        a.c[i][j] = (a.c[i][j] + a.c[i + 1][j]) / 2;
  }
  return result;
}

/// Is `bounded` above 0 wherever `asked` is? Depth bounds the halves of halves.
inline bool positive_where(const Bernstein<2>& asked, const Bernstein<4>& bounded, int depth) {
  if (least(bounded) > 0 || least(weighted_difference(0, asked, asked)) >= 0)
    return true;
  if (depth == 0)
    return false;
  for (const bool right : {false, true})
    if (!positive_where(half(asked, right), half(bounded, right), depth - 1))
      return false;
  return true;
}

/// Where a node of a stencil may lie: on the segment from one place to the other.
struct Range {
  Vec3 from, to;
  Vec3 end(bool far) const { return far ? to : from; }
};

/// (b - a) × (c - a) for a and b on their ranges, as three bilinear functions.
inline std::array<Bernstein<1>, 3> normal(const Range& a, const Range& b, const Vec3& c) {
  std::array<Bernstein<1>, 3> result{};
  for (const bool s : {false, true})
    for (const bool t : {false, true}) {
      const Vec3 n = cross(b.end(t) - a.end(s), c - a.end(s));
      for (int axis = 0; axis < 3; ++axis)
        result[static_cast<std::size_t>(axis)].c[s ? 1 : 0][t ? 1 : 0] = n[axis];
    }
  return result;
}

inline Bernstein<2> dot_product(const std::array<Bernstein<1>, 3>& a,
                                const std::array<Bernstein<1>, 3>& b) {
  Bernstein<2> result;
  for (std::size_t axis = 0; axis < 3; ++axis)
    result = weighted_difference(
        1, result, weighted_difference(-1, product(a[axis], b[axis]), Bernstein<2>{}));
  return result;
}

inline double cosine(double degrees) {
  return std::cos(degrees * std::numbers::pi / 180);
}

/// Do all dihedral angles of the tetrahedron with nodes on these ranges lie within the bounds?
inline bool angles_are_within(const std::array<Range, 4>& nodes, double lowest, double highest) {
  const double low2 = cosine(lowest) * cosine(lowest), high2 = cosine(highest) * cosine(highest);
  for (const auto& [i, j] : tetrahedra::tetrahedron_edges) {
    std::array<std::size_t, 2> rest{};
    std::size_t count = 0;
    for (std::size_t n = 0; n < 4; ++n)
      if (n != i && n != j)
        rest[count++] = n;
    for (const bool far_c : {false, true})
      for (const bool far_d : {false, true}) {
        // The angle between the half planes with C and D: its cosine is n1 · n2 / (|n1| |n2|).
        const auto n1 = normal(nodes[i], nodes[j], nodes[rest[0]].end(far_c));
        const auto n2 = normal(nodes[i], nodes[j], nodes[rest[1]].end(far_d));
        const Bernstein<2> inner = dot_product(n1, n2);
        const Bernstein<4> squares = product(dot_product(n1, n1), dot_product(n2, n2));
        const Bernstein<4> inner2 = product(inner, inner);
        const Bernstein<2> opposite = weighted_difference(-1, inner, Bernstein<2>{});
        if (!positive_where(inner, weighted_difference(low2, squares, inner2), 24) ||
            !positive_where(opposite, weighted_difference(high2, squares, inner2), 24))
          return false;
      }
  }
  return true;
}

} // namespace gewebe::angle_bounds
