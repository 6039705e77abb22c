#pragma once
// Where the rays of a lattice cross a triangle, exactly. Internal to the voxelizer.
//
// Rays run along k through the integer points (i, j); a sample point is (i, j, k). All sample
// points are taken as moved by (e1, e2, e3), 1 >> e1 >> e2 >> e3 > 0, so none lies on an edge's or
// a face's plane.

#include "geometry/vec3.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace gewebe::voxelization {

/// Largest integer <= x. \pre |x| < 2^31
inline std::int32_t floor_int(double x) {
  const auto n = static_cast<std::int32_t>(x);
  return n - (x < n ? 1 : 0);
}
/// Smallest integer >= x. \pre |x| < 2^31
inline std::int32_t ceil_int(double x) {
  const auto n = static_cast<std::int32_t>(x);
  return n + (x > n ? 1 : 0);
}

/// Which coordinate of a sample point is moved by e1, e2, e3. Rays along other axes than k permute
/// the coordinates, and the infinitesimals with them; x is always moved by more than y.
enum class TieOrder { xyz, xzy, zxy };

/// Is sample row (i, j) past the edge p-q in the direction of j? \pre p.x <= i < q.x
bool past_edge(const Vec3& p, const Vec3& q, std::int32_t i, std::int32_t j,
               std::uint64_t& exact_tests);

/// The ray along k through (i, j).
struct Ray {
  std::int32_t i, j;
};

/// Smallest k in [low, high] whose sample (i, j, k) lies past the plane of a, b, c in the direction
/// of k. \pre ray (i, j) crosses the triangle; sample `high` lies past it
std::int32_t first_past_plane(const Vec3& a, const Vec3& b, const Vec3& c, Ray ray,
                              std::int32_t low, std::int32_t high, TieOrder ties,
                              std::uint64_t& exact_tests);

/// Where an edge crosses rows of rays: y = p.y + (i - p.x) slope.
struct EdgeLine {
  const Vec3& p;
  const Vec3& q;
  double slope, error;

  /// \pre p.x < q.x
  EdgeLine(const Vec3& from, const Vec3& to) : p(from), q(to) {
    // For p.x <= i <= q.x the place errs by at most 6 u |q.y - p.y| + u |p.y| to first order, u =
    // 2^-53.
    const double dy = q.y - p.y;
    slope = dy / (q.x - p.x);
    error = 0x1p-49 * (std::fabs(p.y) + std::fabs(dy));
  }
  /// Smallest j past the edge, exact. \pre p.x <= i < q.x
  std::int32_t first(std::int32_t i, std::uint64_t& exact_tests) const {
    const double y = p.y + (i - p.x) * slope;
    const std::int32_t below = floor_int(y);
    const double rest = y - below;
    if (rest > error && rest < 1 - error)
      return below + 1;
    const std::int32_t nearest = rest < 0.5 ? below : below + 1;
    return past_edge(p, q, i, nearest, exact_tests) ? nearest : nearest + 1;
  }
};

/// z of a triangle's plane above (i, j) and a bound of its error for rays that cross the triangle;
/// 1 where rounding leaves no bound.
struct PlaneHeight {
  double x, y, z, slope_x = 0, slope_y = 0, error = 1;

  /// \pre a.x <= b.x <= c.x
  PlaneHeight(const Vec3& a, const Vec3& b, const Vec3& c) : x(a.x), y(a.y), z(a.z) {
    const Vec3 u = b - a, v = c - a;
    const double nx = u.y * v.z - u.z * v.y;
    const double ny = u.z * v.x - u.x * v.z;
    const double nz = u.x * v.y - u.y * v.x;
    const double sx = u.x + v.x, sy = std::fabs(u.y) + std::fabs(v.y),
                 sz = std::fabs(u.z) + std::fabs(v.z);
    // A component of the normal errs by 4 u times its two sizes, which a ray in the triangle
    // multiplies by at most the third size; the rest is ten roundings of terms of that product.
    // 22 u together to first order, which the second test keeps good.
    const double size = std::fabs(nz);
    if (!(size > 0x1p-47 * sx * sy))
      return;
    const double inverse = 1 / nz;
    slope_x = -nx * inverse;
    slope_y = -ny * inverse;
    error = 0x1p-47 * (sx * sy * sz) * std::fabs(inverse) + 0x1p-50 * (std::fabs(a.z) + sz);
  }
};

/// Calls `emit(i, j, k)` for each ray (i, j) with row_begin <= i < row_end that crosses the
/// triangle; k is the first sample beyond it. Each edge is rounded to rays by itself, so triangles
/// that share it agree. \pre coordinates as in geometry/exact_predicates.h, magnitudes below 2^30
template <class Emit>
void cross_triangle(const Vec3& corner0, const Vec3& corner1, const Vec3& corner2,
                    std::int32_t row_begin, std::int32_t row_end, TieOrder ties,
                    std::uint64_t& exact_tests, Emit&& emit) {
  const Vec3 *lowest = &corner0, *middle = &corner1, *highest = &corner2;
  if (middle->x < lowest->x)
    std::swap(lowest, middle);
  if (highest->x < middle->x)
    std::swap(middle, highest);
  if (middle->x < lowest->x)
    std::swap(lowest, middle);
  const Vec3 &a = *lowest, &b = *middle, &c = *highest;
  row_begin = std::max(row_begin, ceil_int(a.x));
  row_end = std::min(row_end, ceil_int(c.x));
  if (row_begin >= row_end)
    return;
  const EdgeLine long_edge(a, c);
  const PlaneHeight plane(a, b, c);
  const auto cross_rows = [&](const EdgeLine& short_edge, std::int32_t begin, std::int32_t end) {
    for (std::int32_t i = begin; i < end; ++i) {
      const std::int32_t first = long_edge.first(i, exact_tests);
      const std::int32_t second = short_edge.first(i, exact_tests);
      const std::int32_t low = std::min(first, second), high = std::max(first, second);
      if (low == high)
        continue;
      const double row_z = plane.z + (i - plane.x) * plane.slope_x;
      for (std::int32_t j = low; j < high; ++j) {
        const double z = row_z + (j - plane.y) * plane.slope_y;
        if (plane.error < 0.25) {
          const std::int32_t below = floor_int(z);
          const double rest = z - below;
          if (rest > plane.error && rest < 1 - plane.error) {
            emit(i, j, below + 1);
          } else {
            const std::int32_t nearest = rest < 0.5 ? below : below + 1;
            emit(i, j, first_past_plane(a, b, c, {i, j}, nearest, nearest + 1, ties, exact_tests));
          }
        } else {
          const auto [z_min, z_max] = std::minmax({a.z, b.z, c.z});
          emit(i, j,
               first_past_plane(a, b, c, {i, j}, ceil_int(z_min), floor_int(z_max) + 1, ties,
                                exact_tests));
        }
      }
    }
  };
  const std::int32_t turn = std::clamp(ceil_int(b.x), row_begin, row_end);
  if (row_begin < turn)
    cross_rows(EdgeLine(a, b), row_begin, turn);
  if (turn < row_end)
    cross_rows(EdgeLine(b, c), turn, row_end);
}

} // namespace gewebe::voxelization
