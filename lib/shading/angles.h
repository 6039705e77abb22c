#pragma once
// Functions of angles made of + - * / and sqrt alone, so that pictures are the same with every
// libm.

#include <array>

namespace gewebe::shading {

/// tan of an angle in degrees, relative error below 1e-13. \pre 0 <= degrees < 90
double tangent(double degrees);

/// cos and sin of an angle in degrees, by tangent(). \pre finite
std::array<double, 2> cos_sin(double degrees);

/// The direction (x, y) as a part of the full turn from +x over +y, 0 … 1 (1 excluded except for
/// rounding), error below 1e-15; 0 for (0, 0).
double turn(double x, double y);

} // namespace gewebe::shading
