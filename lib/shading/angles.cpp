#include "shading/angles.h"

#include <algorithm>
#include <cmath>

namespace gewebe::shading {
namespace {

constexpr double pi = 3.14159265358979323846;

/// 0 <= x <= 1; three halvings of the angle bring the series to |x| < 0.1.
double arc_tangent(double x) {
  for (int halving = 0; halving < 3; ++halving)
    x /= 1 + std::sqrt(1 + x * x);
  const double xx = x * x;
  double sum = 0;
  for (int k = 15; k > 0; k -= 2)
    sum = 1.0 / k - xx * sum;
  return 8 * x * sum;
}

} // namespace

double tangent(double degrees) {
  const double x = degrees * (pi / 180) / 16, xx = x * x;
  double t = x / (1 - xx / (3 - xx / (5 - xx / (7 - xx / (9 - xx / 11))))); // Lambert 1768
  for (int doubling = 0; doubling < 4; ++doubling)
    t = 2 * t / (1 - t * t);
  return t;
}

double turn(double x, double y) {
  const double ax = std::fabs(x), ay = std::fabs(y);
  if (!(std::max(ax, ay) > 0))
    return 0;
  double part = arc_tangent(std::min(ax, ay) / std::max(ax, ay)) / (2 * pi); // 0 … 1/8
  if (ay > ax)
    part = 0.25 - part;
  if (x < 0)
    part = 0.5 - part;
  return y < 0 ? 1 - part : part;
}

std::array<double, 2> cos_sin(double degrees) {
  degrees -= 360 * std::floor(degrees / 360);
  const double quarters = std::floor(degrees / 90);
  const double t = tangent((degrees - 90 * quarters) / 2);
  const double c = (1 - t * t) / (1 + t * t), s = 2 * t / (1 + t * t);
  switch (static_cast<int>(quarters)) {
  case 0:
    return {c, s};
  case 1:
    return {-s, c};
  case 2:
    return {-c, -s};
  default:
    return {s, -c};
  }
}

} // namespace gewebe::shading
