#pragma once
// Solid angles of eight triangles at once, once per CPU level; every level gives the same bits. No
// products are contracted.

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace gewebe::voxelization {

inline constexpr std::size_t solid_angle_lanes = 8;

/// Corners of eight triangles: corner[c][axis][lane].
struct SolidAngleTriangles {
  double corner[3][3][solid_angle_lanes];
};

/// Half the solid angle of each triangle from `point`, positive from behind (van Oosterom and
/// Strackee 1983, eq. 8). Returns a bit for each lane whose sign is certain in double; the values
/// of the others mean nothing.
using SolidAngleKernel = std::uint32_t (*)(const SolidAngleTriangles& triangles,
                                           const double* point, double* half_angles);

std::uint32_t solid_angles_baseline(const SolidAngleTriangles& triangles, const double* point,
                                    double* half_angles);
std::uint32_t solid_angles_avx2(const SolidAngleTriangles& triangles, const double* point,
                                double* half_angles);

/// The bodies; `inline` in an unnamed namespace, so that each unit has its own code.
namespace {

/// arg(x + i y) in [0, pi] for y >= 0, by +, -, x, / alone; errs by less than 1e-15. 0 for 0, 0.
inline double angle(double x, double y) {
  constexpr double pi = 3.14159265358979323846;
  const double ax = std::fabs(x);
  const bool steep = y > ax;
  const double high = steep ? y : ax, low = steep ? ax : y; // low/high is in [0, tan pi/4]
  // Turned back by 0, pi/8 or pi/4 the angle is within pi/16 of 0.
  constexpr double tan_pi_16 = 0.19891236737965800, tan_3_pi_16 = 0.66817863791929892,
                   tan_pi_8 = 0.41421356237309505;
  const bool flat = low < tan_pi_16 * high, middle = low < tan_3_pi_16 * high;
  const double turn = flat ? 0 : middle ? tan_pi_8 : 1;
  const double turn_angle = flat ? 0 : middle ? pi / 8 : pi / 4;
  const double t = (low - turn * high) / (high + turn * low), s = t * t;
  double series = 1.0 / 23; // atan t = t - t³/3 + …; s < 0.04, so 12 terms reach 1e-17
  series = 1.0 / 21 - s * series;
  series = 1.0 / 19 - s * series;
  series = 1.0 / 17 - s * series;
  series = 1.0 / 15 - s * series;
  series = 1.0 / 13 - s * series;
  series = 1.0 / 11 - s * series;
  series = 1.0 / 9 - s * series;
  series = 1.0 / 7 - s * series;
  series = 1.0 / 5 - s * series;
  series = 1.0 / 3 - s * series;
  series = 1.0 - s * series;
  const double octant = turn_angle + t * series,
               beyond = pi / 2 - octant; // so the loop has no branch
  const double quadrant = steep ? beyond : octant, mirrored = pi - quadrant;
  const double result = x < 0 ? mirrored : quadrant;
  return high > 0 ? result : 0;
}

/// Relative to |u| |v| |w|, more than the rounding of u . (v x w) with u, v, w rounded differences.
inline constexpr double determinant_rounding = 0x1p-46;

inline std::uint32_t solid_angles(const SolidAngleTriangles& triangles, const double* point,
                                  double* half_angles) {
  constexpr std::size_t lanes = solid_angle_lanes;
  double d[3][3][lanes], length[3][lanes], certain[lanes];
  for (int c = 0; c < 3; ++c) {
    for (int a = 0; a < 3; ++a)
      for (std::size_t n = 0; n < lanes; ++n)
        d[c][a][n] = triangles.corner[c][a][n] - point[a];
    for (std::size_t n = 0; n < lanes; ++n)
      length[c][n] =
          std::sqrt(d[c][0][n] * d[c][0][n] + d[c][1][n] * d[c][1][n] + d[c][2][n] * d[c][2][n]);
  }
  const auto dot = [&](int b, int c, std::size_t n) {
    return d[b][0][n] * d[c][0][n] + d[b][1][n] * d[c][1][n] + d[b][2][n] * d[c][2][n];
  };
  for (std::size_t n = 0; n < lanes; ++n) {
    const double volume = d[0][0][n] * (d[1][1][n] * d[2][2][n] - d[1][2][n] * d[2][1][n]) +
                          d[0][1][n] * (d[1][2][n] * d[2][0][n] - d[1][0][n] * d[2][2][n]) +
                          d[0][2][n] * (d[1][0][n] * d[2][1][n] - d[1][1][n] * d[2][0][n]);
    const double product = length[0][n] * length[1][n] * length[2][n];
    const double denominator = product + dot(0, 1, n) * length[2][n] + dot(1, 2, n) * length[0][n] +
                               dot(2, 0, n) * length[1][n];
    certain[n] = std::fabs(volume) - determinant_rounding * product;
    const double half = angle(denominator, std::fabs(volume)), opposite = -half;
    half_angles[n] = volume > 0 ? half : opposite;
  }
  std::uint32_t bits = 0;
  for (std::size_t n = 0; n < lanes; ++n)
    bits |= certain[n] > 0 ? 1U << n : 0U;
  return bits;
}

} // namespace

} // namespace gewebe::voxelization
