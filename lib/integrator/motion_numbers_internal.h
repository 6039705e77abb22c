#pragma once
// Long vectors of integrator/solid_motion.h: sums in one order, on any number of threads.

#include "base/context.h"
#include "base/parallel.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace gewebe::integrator {

using Numbers = std::vector<double>;

/// Of 3 n axes: what a thread does at once, whole nodes; for less, a thread costs more than it
/// does.
inline constexpr std::size_t axes_grain = 49152;

/// Four sums side by side: always the same, and not one addition after the other.
template <class A>
double product(std::span<const A> a, std::span<const double> b) {
  std::array<double, 4> sum{};
  std::size_t k = 0;
  for (; k + 4 <= a.size(); k += 4)
    for (std::size_t lane = 0; lane < 4; ++lane)
      sum[lane] += static_cast<double>(a[k + lane]) * b[k + lane];
  for (; k < a.size(); ++k)
    sum[0] += static_cast<double>(a[k]) * b[k];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}
inline double product(const Numbers& a, const Numbers& b) {
  return product(std::span(a), std::span(b));
}

/// to += factor · of
inline void add(std::span<double> to, double factor, std::span<const double> of) {
  for (std::size_t k = 0; k < to.size(); ++k)
    to[k] += factor * of[k];
}

/// Sums over [0, axes): part(begin, end, sums) adds a block's.
template <std::size_t Width, class Part>
std::array<double, Width> sums_of_axes(const Context& context, std::size_t axes, const Part& part) {
  std::vector<std::array<double, Width>> of_block((axes + axes_grain - 1) / axes_grain);
  parallel_blocks(context, axes, axes_grain, [&](std::size_t begin, std::size_t end) {
    part(begin, end, of_block[begin / axes_grain]);
  });
  std::array<double, Width> sums{};
  for (const auto& block : of_block)
    for (std::size_t k = 0; k < Width; ++k)
      sums[k] += block[k];
  return sums;
}

} // namespace gewebe::integrator
