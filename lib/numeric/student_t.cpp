#include "numeric/student_t.h"

#include <cmath>

namespace gewebe::numeric {
namespace {

/// P(|T| <= t) at t = tan(angle) sqrt(freedom).
double central_probability(double angle, std::uint64_t freedom) {
  const bool odd = freedom % 2 == 1;
  const double sine = std::sin(angle), cosine = std::cos(angle), square = cosine * cosine;
  double term = odd ? cosine : 1, sum = 0;
  for (std::uint64_t k = odd ? 1 : 0; k + 1 < freedom; k += 2) {
    sum += term;
    term *= square * static_cast<double>(k + 1) / static_cast<double>(k + 2);
  }
  return odd ? 2 / M_PI * (angle + sine * sum) : sine * sum;
}

} // namespace

double student_t_quantile(double tail, std::uint64_t freedom) {
  double low = 0, high = M_PI / 2;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (central_probability(middle, freedom) < 1 - 2 * tail ? low : high) = middle;
  }
  return std::sqrt(static_cast<double>(freedom)) * std::tan(0.5 * (low + high));
}

} // namespace gewebe::numeric
