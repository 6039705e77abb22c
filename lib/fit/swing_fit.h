#pragma once
// Frequency and damping of a swing that dies away, from samples of it.
//
//   y(t) = c + e^(-Z w t) (a cos w' t + b sin w' t),   w' = w √(1 - Z²)
//
// by least squares (Levenberg and Marquardt), from the best of the frequencies that the samples
// can tell apart. Units: s, Hz; y in any.

#include <array>
#include <span>

namespace gewebe::fit {

struct SwingFit {
  double frequency = 0; ///< of the damped swing, w'/2π, Hz
  double ratio = 0;     ///< Z, of the critical damping
  /// Where they lie with a probability of 95 %, if differences are independent.
  std::array<double, 2> frequency_interval{}, ratio_interval{};
  double rest = 0;      ///< c
  double amplitude = 0; ///< at the first sample
  double explained = 0; ///< part of the samples' variance
};

/// \pre times and values are as many, finite
/// \throw Error if there are fewer than 10 samples or 1.5 swings, times don't ascend, more than
/// half of the variance stays unexplained, or the swing doesn't die away
SwingFit fit_swing(std::span<const double> times, std::span<const double> values);

} // namespace gewebe::fit
