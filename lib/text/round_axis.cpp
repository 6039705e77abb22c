#include "text/round_axis.h"

#include "text/number_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace gewebe::text {
namespace {

/// The number with so many decimals, or with an exponent where it is long; -0 as 0.
std::string mark_text(double value, int decimals, bool exponent) {
  std::array<char, 400> text{};
  const auto end = exponent ? std::to_chars(text.data(), text.data() + text.size(), value,
                                            std::chars_format::general, 6)
                            : std::to_chars(text.data(), text.data() + text.size(), value,
                                            std::chars_format::fixed, decimals);
  return {text.data(), end.ptr};
}

} // namespace

RoundAxis round_axis(double min, double max, std::size_t count) {
  if (!(max - min > 1e-12 * std::max(std::abs(min), std::abs(max)))) {
    const double room = min == 0 ? 1 : std::abs(min) / 2;
    min -= room;
    max += room;
  }
  const double wanted = (max / 2 - min / 2) / static_cast<double>(count) * 2;
  double power = 1;
  int decimals = 0;
  for (; power > wanted && decimals < 320; ++decimals)
    power /= 10;
  for (; power * 10 <= wanted; --decimals)
    power *= 10;
  const double step = wanted > 5 * power   ? 10 * power
                      : wanted > 2 * power ? 5 * power
                      : wanted > power     ? 2 * power
                                           : power;
  if (step >= 10 * power)
    --decimals;
  // A hair is rounding, not another mark.
  const double first = std::floor(min / step + 1e-9), last = std::ceil(max / step - 1e-9);
  RoundAxis axis;
  const bool exponent = decimals > 6 || last * step >= 1e7 || first * step <= -1e7;
  const auto marks = static_cast<std::size_t>(last - first) + 1;
  for (std::size_t k = 0; k < marks; ++k) {
    axis.marks.push_back((first + static_cast<double>(k)) * step + 0.0);
    axis.texts.push_back(mark_text(axis.marks.back(), std::max(decimals, 0), exponent));
  }
  axis.min = axis.marks.front();
  axis.max = axis.marks.back();
  return axis;
}

double round_length(double most) {
  if (!(most > 0 && most <= 1e300))
    return 0;
  double power = 1;
  while (power > most && power > 1e-300)
    power /= 10;
  while (power * 10 <= most)
    power *= 10;
  const double factor = most >= 5 * power ? 5 : most >= 2 * power ? 2 : 1;
  // 5e-2 instead of 0.05000000000000001
  return std::stod(six_digits(factor * power));
}

} // namespace gewebe::text
