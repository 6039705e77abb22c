#pragma once
// Long vectors of solid/solid_motion.h: sums in one order.

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace gewebe {

using Numbers = std::vector<double>;

/// Four sums side by side: always the same, and not one addition after the other.
inline double product(std::span<const double> a, std::span<const double> b) {
  std::array<double, 4> sum{};
  std::size_t k = 0;
  for (; k + 4 <= a.size(); k += 4)
    for (std::size_t lane = 0; lane < 4; ++lane)
      sum[lane] += a[k + lane] * b[k + lane];
  for (; k < a.size(); ++k)
    sum[0] += a[k] * b[k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/// to += factor · of
inline void add(std::span<double> to, double factor, std::span<const double> of) {
  for (std::size_t k = 0; k < to.size(); ++k)
    to[k] += factor * of[k];
}

} // namespace gewebe
