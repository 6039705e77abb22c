#pragma once
// Maximum and minimum of two numbers that propagate NaN. std::max, std::fmax and `x > worst` drop a
// NaN, so that a later comparison with a bound would miss it.

#include <cmath>
#include <type_traits>

namespace gewebe::numeric {

/// Whether x is NaN; false for types without NaN.
template <class T>
bool is_nan(T x) {
  if constexpr (std::is_floating_point_v<T>)
    return std::isnan(x);
  else
    return false;
}

/// The larger one, NaN if either is.
template <class T>
T larger(T a, std::type_identity_t<T> b) {
  return a >= b || is_nan(a) ? a : b;
}

/// The smaller one, NaN if either is.
template <class T>
T smaller(T a, std::type_identity_t<T> b) {
  return a <= b || is_nan(a) ? a : b;
}

} // namespace gewebe::numeric
