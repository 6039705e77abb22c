#include "integrator/motion_forecast_internal.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gewebe::integrator {

void MotionForecast::add(Numbers acceleration, const Numbers& masses, const Context& context) {
  for (std::size_t i = most; i-- > 1;)
    for (std::size_t j = most; j-- > 1;)
      product_[i][j] = product_[i - 1][j - 1];
  past_.emplace_front(std::move(acceleration));
  if (past_.size() > most)
    past_.pop_back();
  const Numbers& newest = *past_.front();
  product_[0] =
      sums_of_axes<most>(context, newest.size(),
                         [&](std::size_t begin, std::size_t end, std::array<double, most>& sums) {
                           for (std::size_t j = 0; j < past_.size(); ++j)
                             for (std::size_t axis = begin; axis < end; ++axis)
                               sums[j] += masses[axis / 3] * newest[axis] * (*past_[j])[axis];
                         });
  for (std::size_t j = 1; j < most; ++j)
    product_[j][0] = product_[0][j];
}

/// Of the newest ones in the sum.
std::array<double, MotionForecast::terms> MotionForecast::weights() const {
  if (past_.size() < 2)
    return {1, 0, 0};
  constexpr std::array<double, terms> straight = {2, -1, 0};
  if (past_.size() < 4)
    return straight;
  // Normal equations, regularised by rounding errors of steps, by Gauss.
  const std::size_t count = std::min(terms, past_.size() - 2);
  std::array<std::array<double, terms + 1>, terms> m{};
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j)
      m[i][j] = product_[i + 1][j + 1];
    m[i][i] *= 1 + 1e-6;
    m[i][terms] = product_[i + 1][0];
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (!(m[i][i] > 0))
      return straight;
    for (std::size_t j = i + 1; j < count; ++j)
      for (std::size_t k = terms + 1; k-- > i;)
        m[j][k] -= m[j][i] / m[i][i] * m[i][k];
  }
  std::array<double, terms> weights{};
  for (std::size_t i = count; i-- > 0;) {
    double sum = m[i][terms];
    for (std::size_t j = i + 1; j < count; ++j)
      sum -= m[i][j] * weights[j];
    weights[i] = sum / m[i][i];
    if (!std::isfinite(weights[i]))
      return straight;
  }
  return weights;
}

void MotionForecast::add_to(Numbers& to, double factor, const Context& context) const {
  if (past_.empty())
    return;
  const std::array<double, terms> weight = weights();
  parallel_blocks(context, to.size(), axes_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = 0; k < std::min(terms, past_.size()); ++k)
      gewebe::integrator::add(std::span(to).subspan(begin, end - begin), factor * weight[k],
                              std::span(*past_[k]).subspan(begin, end - begin));
  });
}

void MotionForecast::hold(std::size_t axis) {
  for (CopyOnWrite<Numbers>& one : past_)
    if ((*one)[axis] != 0)
      one.write()[axis] = 0;
}

} // namespace gewebe::integrator
