#include "numeric/power.h"

#include "numeric/logarithm.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace gewebe::numeric {

namespace {

/// 2^n of a normal number.
double power_of_two(int n) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(n + 1023) << 52);
}

} // namespace

double exponential(double x) {
  if (std::isnan(x))
    return x;
  if (x > 710)
    return std::numeric_limits<double>::infinity();
  if (x < -746)
    return 0;
  // x = k ln 2 + r, |r| < 0.347; ln 2 in two parts, products of the first with k are exact.
  constexpr double ln2 = 0x1.62e42fefa39efp-1, ln2_high = 0x1.62e42fee00000p-1,
                   ln2_low = 0x1.a39ef35793c76p-33;
  const int k = static_cast<int>(x / ln2 + (x < 0 ? -0.5 : 0.5));
  const double high = x - k * ln2_high, low = k * ln2_low, r = high - low, z = r * r;
  // r coth(r/2) = 2 + Σ 2 B_2n r^2n / (2n)!, with Bernoulli's numbers; with c = r less this sum,
  // e^r = 1 + r + r c / (2 - c).
  constexpr std::array<double, 6> term{-691.0 / 653837184000, 1.0 / 23950080, -1.0 / 604800,
                                       1.0 / 15120,           -1.0 / 360,     1.0 / 6};
  double sum = 0;
  for (const double t : term)
    sum = (sum + t) * z;
  const double c = r - sum, e = 1 + (high - (low - r * c / (2 - c)));
  // In two factors where 2^k isn't a normal number.
  const int half = k / 2;
  return e * power_of_two(half) * power_of_two(k - half);
}

double power(double x, double y) {
  if (y == 0 || x == 1)
    return 1;
  return exponential(y * natural_logarithm(x));
}

} // namespace gewebe::numeric
