#pragma once
// Exact signs of orientation determinants: first a filter in double precision, then, if the filter
// can't decide, floating-point expansions on the stack.

#include "geometry/vec3.h"

#include <cstdint>

namespace gewebe {

/// Coordinates of the predicates must be 0 or have a magnitude in [smallest, largest]: no partial
/// product can then underflow or overflow.
inline constexpr double predicate_smallest = 0x1p-200;
inline constexpr double predicate_largest = 0x1p40;

/// `x`, or 0 if it is too small for the predicates.
inline double predicate_coordinate(double x) {
  return x < predicate_smallest && x > -predicate_smallest ? 0.0 : x;
}

/// Sign (-1, 0, 1) of (bx-ax)(cy-ay) - (by-ay)(cx-ax): 1 if a, b, c turn left. Adds 1 to
/// `exact_tests` if the filter can't decide. \pre coordinates as above
int turn_sign(double ax, double ay, double bx, double by, double cx, double cy,
              std::uint64_t& exact_tests);

/// Sign of ((b-a) x (c-a)) . (q-a): 1 if q lies on the side from which a, b, c appear
/// counter-clockwise. \pre coordinates as above
int side_sign(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& q,
              std::uint64_t& exact_tests);

} // namespace gewebe
