#pragma once
// Coefficients of SDIRK2, the L-stable Runge-Kutta method of second order with two stages of equal
// length (R. Alexander, Diagonally implicit Runge-Kutta methods for stiff O.D.E.'s, SIAM J. Numer.
// Anal. 14(6), 1977), as two steps of backward Euler:
//
//   y1 = y + g h f(y1),   y2 = z + g h f(y2),   z = y + c (y1 - y),   c = (1 - g)/g.
//
// The first stage is a step of backward Euler to t + g h; the second one begins at z, which is
// extrapolated, and ends at t + h.

namespace gewebe::numeric {

/// Which part of a step an implicit solution is: the step itself, of backward Euler, or a stage.
enum class Stage { whole, first, second };

/// g = 1 - 1/sqrt(2)
inline constexpr double stage_length = 0.29289321881345247560;
/// c = 1 + sqrt(2)
inline constexpr double stage_extension = 2.41421356237309504880;

/// z
inline double extended(double from, double to) {
  return from + stage_extension * (to - from);
}

} // namespace gewebe::numeric
