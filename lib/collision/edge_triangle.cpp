#include "collision/edge_triangle.h"

#include "geometry/exact_predicates.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace gewebe::collision {

namespace {

using Flat = std::array<double, 2>;

int turn(const Flat& a, const Flat& b, const Flat& c) {
  std::uint64_t tests = 0;
  return turn_sign(a[0], a[1], b[0], b[1], c[0], c[1], tests);
}

/// Whether c lies between a and b. \pre the three points are on one line
bool between(const Flat& a, const Flat& b, const Flat& c) {
  for (std::size_t axis = 0; axis < 2; ++axis)
    if ((c[axis] < a[axis] && c[axis] < b[axis]) || (c[axis] > a[axis] && c[axis] > b[axis]))
      return false;
  return true;
}

bool segments_meet(const Flat& p, const Flat& q, const Flat& a, const Flat& b) {
  const int pa = turn(p, q, a), pb = turn(p, q, b), ap = turn(a, b, p), aq = turn(a, b, q);
  if (pa * pb < 0 && ap * aq < 0)
    return true;
  return (pa == 0 && between(p, q, a)) || (pb == 0 && between(p, q, b)) ||
         (ap == 0 && between(a, b, p)) || (aq == 0 && between(a, b, q));
}

/// All in one plane, seen along an axis in which the triangle has an area.
bool meets_in_plane(const Flat& p, const Flat& q, const std::array<Flat, 3>& t) {
  const int s0 = turn(t[0], t[1], p), s1 = turn(t[1], t[2], p), s2 = turn(t[2], t[0], p);
  if ((s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0))
    return true;
  return segments_meet(p, q, t[0], t[1]) || segments_meet(p, q, t[1], t[2]) ||
         segments_meet(p, q, t[2], t[0]);
}

} // namespace

bool edge_meets_triangle(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b,
                         const Vec3& c) {
  std::uint64_t tests = 0;
  const int sp = side_sign(a, b, c, p, tests), sq = side_sign(a, b, c, q, tests);
  if (sp * sq > 0)
    return false;
  if (sp != 0 || sq != 0) {
    const int ab = side_sign(p, q, a, b, tests), bc = side_sign(p, q, b, c, tests),
              ca = side_sign(p, q, c, a, tests);
    return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
  }
  // Coplanar: leave out an axis along which the triangle keeps an area.
  for (int axis = 0; axis < 3; ++axis) {
    const auto flat = [&](const Vec3& x) { return Flat{x[(axis + 1) % 3], x[(axis + 2) % 3]}; };
    if (turn(flat(a), flat(b), flat(c)) != 0)
      return meets_in_plane(flat(p), flat(q), {flat(a), flat(b), flat(c)});
  }
  return false;
}

} // namespace gewebe::collision
