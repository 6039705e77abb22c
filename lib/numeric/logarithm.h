#pragma once
// Natural logarithm made of + - * / alone, so that results are the same with every libm and on
// every processor.

namespace gewebe::numeric {

/// ln x, error below 1 ulp. As std::log for 0 (-inf), negative numbers (NaN), inf and NaN.
double natural_logarithm(double x);

} // namespace gewebe::numeric
