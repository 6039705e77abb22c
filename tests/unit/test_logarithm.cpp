#include "numeric/logarithm.h"

#include "larger.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace gewebe::test {
namespace {

double ulps(double x) {
  const long double exact = std::log(static_cast<long double>(x));
  const double rounded = static_cast<double>(exact);
  const double ulp = std::nextafter(std::abs(rounded), HUGE_VAL) - std::abs(rounded);
  return static_cast<double>(
             std::abs(static_cast<long double>(numeric::natural_logarithm(x)) - exact)) /
         ulp;
}

TEST(Logarithm, WithinAnUlpOfTheExactOne) {
  std::mt19937_64 random(1);
  double worst = 0;
  for (int k = 0; k < 300000; ++k) {
    const double x = std::bit_cast<double>(random() % 0x7ff0000000000000U);
    worst = test::larger(worst, ulps(x));
    // Near 1, where the result is small, and where barriers are.
    const double near = 1 + std::ldexp(static_cast<double>(random() >> 11) * 0x1p-53 - 0.5,
                                       -static_cast<int>(random() % 50));
    if (near != 1)
      worst = test::larger(worst, ulps(near));
    worst = test::larger(worst, ulps(static_cast<double>((random() >> 11) + 1) * 0x1p-53));
  }
  EXPECT_LE(worst, 1);
  for (const double x : {0x1p-1074, 0x1.8p-1050, 0x1p-1022, 0x1.fffffffffffffp1023, 2.0, 0.5, 0.7,
                         0x1.6a09e667f3bcdp0, 0x1.6a09e667f3bccp0, 0x1.fffffffffffffp-1})
    EXPECT_LE(ulps(x), 1) << x;
}

TEST(Logarithm, EndsOfTheRange) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(numeric::natural_logarithm(1), 0);
  EXPECT_EQ(numeric::natural_logarithm(0), -inf);
  EXPECT_EQ(numeric::natural_logarithm(inf), inf);
  EXPECT_TRUE(std::isnan(numeric::natural_logarithm(-1)));
  EXPECT_TRUE(std::isnan(numeric::natural_logarithm(std::nan(""))));
}

} // namespace
} // namespace gewebe::test
