// Quantiles of Student's t distribution against closed forms and tables.

#include "numeric/student_t.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gewebe::test_student_t {
namespace {

// One and two degrees of freedom have closed forms.
TEST(StudentT, OneAndTwoDegreesOfFreedom) {
  for (const double tail : {0.49, 0.25, 0.025, 1e-4}) {
    EXPECT_NEAR(numeric::student_t_quantile(tail, 1) * std::tan(M_PI * tail), 1, 1e-10) << tail;
    const double a = 4 * tail * (1 - tail);
    EXPECT_NEAR(numeric::student_t_quantile(tail, 2) / (2 * (0.5 - tail) * std::sqrt(2 / a)), 1,
                1e-10)
        << tail;
  }
  EXPECT_NEAR(numeric::student_t_quantile(0.5, 7), 0, 1e-15);
}

// Abramowitz & Stegun 1964, table 26.10, and the normal distribution.
TEST(StudentT, Table) {
  EXPECT_NEAR(numeric::student_t_quantile(0.025, 3), 3.182, 5e-4);
  EXPECT_NEAR(numeric::student_t_quantile(0.005, 4), 4.604, 5e-4);
  EXPECT_NEAR(numeric::student_t_quantile(0.05, 5), 2.015, 5e-4);
  EXPECT_NEAR(numeric::student_t_quantile(0.025, 30), 2.042, 5e-4);
  EXPECT_NEAR(numeric::student_t_quantile(0.0005, 120), 3.373, 5e-4);
  EXPECT_NEAR(numeric::student_t_quantile(0.025, 1'000'001), 1.959966, 2e-6);
}

} // namespace
} // namespace gewebe::test_student_t
