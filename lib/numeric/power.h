#pragma once
// Exponential function and powers made of + - * / alone, so that results are the same with every
// libm and on every processor.

namespace gewebe::numeric {

/// e^x, error below 1 ulp where the result is a normal number. 0 below about -745, inf above about
/// 709.8; NaN of NaN.
double exponential(double x);

/// x^y as e^(y ln x): relative error below (2 + |y ln x|) 2.3e-16, and exact for y = 0 and x = 1.
/// \pre x >= 0; 0^y is 0 for y > 0, inf for y < 0
double power(double x, double y);

} // namespace gewebe::numeric
