#pragma once
// How far two solutions are apart.

#include "tests/unit/larger.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace gewebe::test {

/// max|a - b| / max|b|; 0 if both are 0; infinite where b alone is 0 or sizes differ,
/// NaN if a number is, so that no bound passes.
inline double relative_difference(std::span<const double> a, std::span<const double> b) {
  if (a.size() != b.size())
    return HUGE_VAL;
  double max = 0, size = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    max = numeric::larger(max, std::abs(a[k] - b[k]));
    size = numeric::larger(size, std::abs(b[k]));
  }
  return size > 0 ? max / size : max > 0 ? HUGE_VAL : max;
}

/// max|a - b|; infinite where sizes differ, NaN if a number is.
inline double largest_difference(std::span<const double> a, std::span<const double> b) {
  double most = a.size() == b.size() ? 0 : HUGE_VAL;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k)
    most = numeric::larger(most, std::abs(a[k] - b[k]));
  return most;
}

} // namespace gewebe::test
