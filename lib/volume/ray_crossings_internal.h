#pragma once
// Where the rays of a lattice cross a triangle, exactly. Internal to the voxelizer.
//
// Rays run along k through the integer points (i, j); a sample point is (i, j, k). All sample
// points are taken as moved by (e1, e2, e3), 1 >> e1 >> e2 >> e3 > 0, so none lies on an edge's or
// a face's plane.

#include "base/vec3.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace gewebe {

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

/// Is sample row (i, j) past the edge p-q in the direction of j? \pre p.x <= i < q.x
bool past_edge(const Vec3& p, const Vec3& q, std::int32_t i, std::int32_t j,
               std::uint64_t& exact_tests);

/// Smallest k in [low, high] whose sample (i, j, k) lies past the plane of a, b, c in the direction
/// of k. \pre ray (i, j) crosses the triangle; sample `high` lies past it
std::int32_t first_past_plane(const Vec3& a, const Vec3& b, const Vec3& c, std::int32_t i,
                              std::int32_t j, std::int32_t low, std::int32_t high,
                              std::uint64_t& exact_tests);

/// Where an edge meets the plane of a row of rays.
struct EdgeHit {
  std::int32_t first; ///< smallest j past the edge, exact
  double y, z;        ///< approximate place
  double y_error, z_error;
};

/// \pre p.x <= i < q.x
inline EdgeHit hit_edge(const Vec3& p, const Vec3& q, std::int32_t i, std::uint64_t& exact_tests) {
  // With t in [0, 1], p + t (q - p) errs by at most 6 u |q - p| + u |p| to first order, u = 2^-53.
  constexpr double error_factor = 0x1p-49;
  const double t = (i - p.x) / (q.x - p.x);
  const double dy = q.y - p.y, dz = q.z - p.z;
  EdgeHit hit;
  hit.y = p.y + t * dy;
  hit.z = p.z + t * dz;
  hit.y_error = error_factor * (std::fabs(p.y) + std::fabs(dy));
  hit.z_error = error_factor * (std::fabs(p.z) + std::fabs(dz));
  const std::int32_t below = floor_int(hit.y);
  const double rest = hit.y - below;
  if (rest > hit.y_error && rest < 1 - hit.y_error) {
    hit.first = below + 1;
  } else {
    const std::int32_t nearest = rest < 0.5 ? below : below + 1;
    hit.first = past_edge(p, q, i, nearest, exact_tests) ? nearest : nearest + 1;
  }
  return hit;
}

/// Calls `emit(i, j, k)` for each ray (i, j) with row_begin <= i < row_end that crosses the
/// triangle; k is the first sample beyond it. Each edge is rounded to rays by itself, so triangles
/// that share it agree. \pre coordinates as in exact_predicates.h, magnitudes below 2^30
template <class Emit>
void cross_triangle(Vec3 a, Vec3 b, Vec3 c, std::int32_t row_begin, std::int32_t row_end,
                    std::uint64_t& exact_tests, Emit&& emit) {
  if (b.x < a.x)
    std::swap(a, b);
  if (c.x < b.x)
    std::swap(b, c);
  if (b.x < a.x)
    std::swap(a, b);
  row_begin = std::max(row_begin, ceil_int(a.x));
  row_end = std::min(row_end, ceil_int(c.x));
  for (std::int32_t i = row_begin; i < row_end; ++i) {
    const EdgeHit long_edge = hit_edge(a, c, i, exact_tests);
    const EdgeHit short_edge =
        i < b.x ? hit_edge(a, b, i, exact_tests) : hit_edge(b, c, i, exact_tests);
    if (long_edge.first == short_edge.first)
      continue;
    const bool long_is_low = long_edge.first < short_edge.first;
    const EdgeHit& low = long_is_low ? long_edge : short_edge;
    const EdgeHit& high = long_is_low ? short_edge : long_edge;
    // Between the two hits z is linear in j: a shift of both ends by y_error moves it by 3 y_error
    // / width of the rise.
    const double width = high.y - low.y, rise = high.z - low.z;
    const double y_error = std::max(low.y_error, high.y_error);
    double error = 1;
    if (width > 8 * y_error)
      error = 4 * (low.z_error + high.z_error) + 4 * y_error / width * std::fabs(rise);
    const double slope = rise / width;
    for (std::int32_t j = low.first; j < high.first; ++j) {
      if (error < 0.25) {
        const double z = low.z + (j - low.y) * slope;
        const std::int32_t below = floor_int(z);
        const double rest = z - below;
        if (rest > error && rest < 1 - error) {
          emit(i, j, below + 1);
        } else {
          const std::int32_t nearest = rest < 0.5 ? below : below + 1;
          emit(i, j, first_past_plane(a, b, c, i, j, nearest, nearest + 1, exact_tests));
        }
      } else {
        const auto [z_min, z_max] = std::minmax({a.z, b.z, c.z});
        emit(i, j,
             first_past_plane(a, b, c, i, j, ceil_int(z_min), floor_int(z_max) + 1, exact_tests));
      }
    }
  }
}

} // namespace gewebe
