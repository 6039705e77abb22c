#include "numeric/power.h"

#include "larger.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace gewebe::test {
namespace {

double ulps(double found, long double exact) {
  const double rounded = static_cast<double>(exact);
  const double ulp = std::nextafter(std::abs(rounded), HUGE_VAL) - std::abs(rounded);
  return static_cast<double>(std::abs(static_cast<long double>(found) - exact)) / ulp;
}

TEST(Power, ExponentialIsWithinAnUlpOfTheExactOne) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> wide(-700, 709), near(-1, 1);
  double worst = 0;
  for (int n = 0; n < 300000; ++n) {
    for (const double x : {wide(random), near(random), std::ldexp(near(random), -n % 60)})
      worst =
          test::larger(worst, ulps(numeric::exponential(x), std::exp(static_cast<long double>(x))));
  }
  EXPECT_LE(worst, 1);
  EXPECT_EQ(numeric::exponential(0), 1);
  EXPECT_EQ(numeric::exponential(-0.0), 1);
}

TEST(Power, EndsOfTheRange) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(numeric::exponential(inf), inf);
  EXPECT_EQ(numeric::exponential(709.79), inf);
  EXPECT_LT(numeric::exponential(709.78), inf);
  EXPECT_EQ(numeric::exponential(-inf), 0);
  EXPECT_EQ(numeric::exponential(-750), 0);
  EXPECT_EQ(numeric::exponential(-744.4), 0x1p-1074);
  EXPECT_TRUE(std::isnan(numeric::exponential(std::nan(""))));
  EXPECT_EQ(numeric::power(0, 2), 0);
  EXPECT_EQ(numeric::power(0, -2), inf);
  EXPECT_EQ(numeric::power(0, 0), 1);
  EXPECT_EQ(numeric::power(1, 1e300), 1);
  EXPECT_TRUE(std::isnan(numeric::power(-1, 0.5)));
}

TEST(Power, PowersAreAsExactAsTheirExponentAllows) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> base(0.01, 10), exponent(-30, 30);
  double worst = 0;
  for (int n = 0; n < 300000; ++n) {
    const double x = base(random), y = exponent(random);
    const long double exact = std::pow(static_cast<long double>(x), static_cast<long double>(y));
    worst = test::larger(worst, static_cast<double>(std::abs(
                                    static_cast<long double>(numeric::power(x, y)) / exact - 1)) /
                                    (2 + std::abs(y * std::log(x))));
  }
  EXPECT_LE(worst, 2.3e-16);
}

} // namespace
} // namespace gewebe::test
