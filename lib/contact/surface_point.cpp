#include "contact/surface_point.h"

#include "contact/convex_core.h"

#include <algorithm>

// Based on: C. Ericson, Real-Time Collision Detection, 2005, sections 5.1.5 and 5.1.9.

namespace gewebe {

namespace {

using Weights = std::array<double, 3>;

Weights on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const auto [wa, wb] = weights_on_segment(p, a, b);
  return {wa, wb, 0};
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

/// From a whole polyhedron to a point.
SurfacePoint from_whole(const PlacedInstrument& instrument, const Vec3& p) {
  const Pose pose = instrument.pose();
  const ConvexCore::Nearest nearest = instrument.core->nearest(pose.inverse(p));
  SurfacePoint found;
  found.weights = {1, 0, 0};
  found.place = p;
  found.core = pose(nearest.point);
  found.distance = nearest.distance;
  found.out = rotated(pose.turn, nearest.normal);
  return found;
}

/// Shares of the ways of two segments at the points that are nearest to each other; none where one
/// is not between its ends, or they are along each other: ends and corners have that.
std::optional<std::array<double, 2>> crossing(const Vec3& from, const Vec3& way, const Vec3& a,
                                              const Vec3& edge) {
  const Vec3 apart = from - a;
  const double e = dot(edge, edge), k = dot(way, way), x = dot(edge, way), det = e * k - x * x;
  if (!(det > 1e-12 * e * k))
    return std::nullopt;
  const double t = (dot(edge, apart) * k - dot(way, apart) * x) / det;
  if (!(t > 0 && t < 1))
    return std::nullopt;
  const double along = (t * x - dot(way, apart)) / k;
  if (!(along > 0 && along < 1))
    return std::nullopt;
  return std::array{along, t};
}

} // namespace

std::optional<SurfacePoint> nearest_points(const PlacedInstrument& instrument, CorePart part,
                                           const std::array<Vec3, 3>& corners, int count) {
  const auto& [a, b, c] = corners;
  if (part.kind == CorePart::Kind::whole)
    return from_whole(instrument, a);
  const ConvexCore* const core = instrument.core.get();
  SurfacePoint found;
  if (part.kind == CorePart::Kind::edge) {
    Vec3 from = instrument.a, way = instrument.ab;
    if (core != nullptr) {
      const ConvexCore::Edge& edge = core->edges()[part.number];
      from = instrument.pose()(core->corners()[edge.a]);
      way = rotated(instrument.turn, core->corners()[edge.b] - core->corners()[edge.a]);
    }
    double along = 0; // of the core
    if (count == 1) {
      found.weights = {1, 0, 0};
      along = dot(a - from, way) * instrument.inverse_square;
      if (!(along > 0 && along < 1))
        return std::nullopt;
    } else {
      const auto shares = crossing(from, way, a, b - a);
      if (!shares)
        return std::nullopt;
      along = (*shares)[0];
      found.weights = {1 - (*shares)[1], (*shares)[1], 0};
    }
    found.core = from + along * way;
  } else {
    found.core = core != nullptr               ? instrument.pose()(core->corners()[part.number])
                 : part == CorePart::first_end ? instrument.a
                                               : instrument.a + instrument.ab;
    found.weights = count == 1   ? Weights{1, 0, 0}
                    : count == 2 ? on_segment(found.core, a, b)
                                 : on_triangle(found.core, a, b, c);
    if (core != nullptr && std::ranges::find(found.weights, 1.0) != found.weights.end())
      return std::nullopt; // the whole core and that corner
  }
  found.place = found.weights[0] * a + found.weights[1] * b + found.weights[2] * c;
  found.distance = norm(found.place - found.core);
  if (core != nullptr) {
    const Vec3 own = rotated_back(instrument.turn, found.place - found.core);
    found.behind = part.kind == CorePart::Kind::edge ? core->leads_in_from_edge(part.number, own)
                                                     : core->leads_in_from_corner(part.number, own);
  }
  return found;
}

bool goes_through(const PlacedInstrument& instrument, const std::array<Vec3, 3>& corners) {
  const auto& [a, b, c] = corners;
  if (instrument.core) {
    const Pose pose = instrument.pose();
    return instrument.core->meets({pose.inverse(a), pose.inverse(b), pose.inverse(c)});
  }
  const Vec3 normal = cross(b - a, c - a);
  const double first = dot(normal, instrument.a - a), along = dot(normal, instrument.ab);
  if (!(first * (first + along) < 0))
    return false;
  const Vec3 at = instrument.a - first / along * instrument.ab;
  return dot(normal, cross(b - a, at - a)) > 0 && dot(normal, cross(c - b, at - b)) > 0 &&
         dot(normal, cross(a - c, at - c)) > 0;
}

} // namespace gewebe
