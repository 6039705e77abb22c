#include "contact/surface_point.h"

#include <algorithm>

// Based on: C. Ericson, Real-Time Collision Detection, 2005, sections 5.1.5 and 5.1.9.

namespace gewebe {

namespace {

using Weights = std::array<double, 3>;

Weights on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double along = dot(p - a, ab), square = dot(ab, ab);
  if (!(along > 0))
    return {1, 0, 0};
  if (!(along < square))
    return {0, 1, 0};
  return {1 - along / square, along / square, 0};
}

Weights on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0)
    return {1, 0, 0};
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3)
    return {0, 1, 0};
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6)
    return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = d1 / (d1 - d3);
    return {1 - t, t, 0};
  }
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = d2 / (d2 - d6);
    return {1 - t, 0, t};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

} // namespace

std::optional<SurfacePoint> nearest_points(const PlacedInstrument& instrument, CorePart part,
                                           const std::array<Vec3, 3>& corners, int count) {
  const auto& [a, b, c] = corners;
  SurfacePoint found;
  if (part == CorePart::between) {
    double along = 0; // of the core
    if (count == 1) {
      found.weights = {1, 0, 0};
      along = dot(a - instrument.a, instrument.ab) * instrument.inverse_square;
    } else {
      const Vec3 edge = b - a, from = instrument.a - a;
      const double e = dot(edge, edge), k = dot(instrument.ab, instrument.ab),
                   x = dot(edge, instrument.ab), det = e * k - x * x;
      if (!(det > 1e-12 * e * k)) // along each other: ends and corners have it
        return std::nullopt;
      const double t = (dot(edge, from) * k - dot(instrument.ab, from) * x) / det;
      if (!(t > 0 && t < 1))
        return std::nullopt;
      found.weights = {1 - t, t, 0};
      along = (t * x - dot(instrument.ab, from)) / k;
    }
    if (!(along > 0 && along < 1))
      return std::nullopt;
    found.core = instrument.a + along * instrument.ab;
  } else {
    found.core = part == CorePart::first_end ? instrument.a : instrument.a + instrument.ab;
    found.weights = count == 1   ? Weights{1, 0, 0}
                    : count == 2 ? on_segment(found.core, a, b)
                                 : on_triangle(found.core, a, b, c);
  }
  found.place = found.weights[0] * a + found.weights[1] * b + found.weights[2] * c;
  found.distance = norm(found.place - found.core);
  return found;
}

bool goes_through(const PlacedInstrument& instrument, const std::array<Vec3, 3>& corners) {
  const auto& [a, b, c] = corners;
  const Vec3 normal = cross(b - a, c - a);
  const double first = dot(normal, instrument.a - a), along = dot(normal, instrument.ab);
  if (!(first * (first + along) < 0))
    return false;
  const Vec3 at = instrument.a - first / along * instrument.ab;
  return dot(normal, cross(b - a, at - a)) > 0 && dot(normal, cross(c - b, at - b)) > 0 &&
         dot(normal, cross(a - c, at - c)) > 0;
}

} // namespace gewebe
