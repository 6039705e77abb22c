#pragma once

#include <cmath>

namespace gewebe::test {

/// The larger one, NaN if either is: std::fmax would drop a NaN, and the test would not see it.
inline double larger(double a, double b) {
  return a >= b || std::isnan(a) ? a : b;
}

} // namespace gewebe::test
