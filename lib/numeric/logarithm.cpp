#include "numeric/logarithm.h"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace gewebe::numeric {

double natural_logarithm(double x) {
  if (!(x > 0))
    return x == 0 ? -std::numeric_limits<double>::infinity()
                  : std::numeric_limits<double>::quiet_NaN();
  if (x == std::numeric_limits<double>::infinity())
    return x;
  int exponent = 0;
  if (x < std::numeric_limits<double>::min()) { // subnormal
    x *= 0x1p54;
    exponent = -54;
  }
  // x = 2^exponent (1 + f), 1 + f between sqrt(1/2) and sqrt(2)
  std::uint64_t bits = std::bit_cast<std::uint64_t>(x);
  exponent += static_cast<int>(bits >> 52) - 1023;
  bits = (bits & 0xfffffffffffffU) | (std::uint64_t{1023} << 52);
  double m = std::bit_cast<double>(bits);
  if (m > 0x1.6a09e667f3bcdp0) {
    m *= 0.5;
    ++exponent;
  }
  const double f = m - 1;
  // ln(1 + f) = 2 artanh s, s = f / (2 + f), |s| < 0.172; 2 s = f - s f = f - f^2/2 + s f^2/2
  const double s = f / (2 + f), z = s * s, half = 0.5 * f * f;
  constexpr std::array<double, 11> term{2.0 / 23, 2.0 / 21, 2.0 / 19, 2.0 / 17, 2.0 / 15, 2.0 / 13,
                                        2.0 / 11, 2.0 / 9,  2.0 / 7,  2.0 / 5,  2.0 / 3};
  double rest = 0;
  for (const double t : term)
    rest = (rest + t) * z;
  // ln 2 in two parts; products of the first with an exponent are exact.
  constexpr double ln2_high = 0x1.62e42fee00000p-1, ln2_low = 0x1.a39ef35793c76p-33;
  const double k = exponent;
  return k * ln2_high - ((half - (s * (half + rest) + k * ln2_low)) - f);
}

} // namespace gewebe::numeric
