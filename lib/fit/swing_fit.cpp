#include "fit/swing_fit.h"

#include "base/error.h"
#include "numeric/student_t.h"
#include "text/rounded_text.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>

namespace gewebe::fit {

namespace {

constexpr std::size_t fewest = 10;
constexpr double fewest_swings = 1.5;
constexpr double least_explained = 0.5;
constexpr double start_decay = 0.05; // of the circular frequency, where the search begins

using Vector = Eigen::VectorXd;

/// Samples with times from 0.
struct Samples {
  Vector t, y;
  double variance = 0; ///< sum of squares about the mean
};

/// rest, cosine, sine, decay rate, circular frequency
using Parameters = Eigen::Matrix<double, 5, 1>;

/// y - what the swing is, and its derivatives.
void differences(const Samples& s, const Parameters& p, Vector& r,
                 Eigen::Matrix<double, Eigen::Dynamic, 5>& jacobian) {
  r.resize(s.t.size());
  jacobian.resize(s.t.size(), 5);
  for (Eigen::Index k = 0; k < s.t.size(); ++k) {
    const double t = s.t[k], e = std::exp(-p[3] * t), c = e * std::cos(p[4] * t),
                 n = e * std::sin(p[4] * t), swing = p[1] * c + p[2] * n;
    r[k] = s.y[k] - p[0] - swing;
    jacobian.row(k) << 1, c, n, -t * swing, t * (p[2] * c - p[1] * n);
  }
}

double squares(const Samples& s, const Parameters& p) {
  Vector r;
  Eigen::Matrix<double, Eigen::Dynamic, 5> none;
  differences(s, p, r, none);
  return r.squaredNorm();
}

/// The best rest, cosine and sine for a decay rate and a frequency.
Parameters best_amplitudes(const Samples& s, double decay, double frequency) {
  Parameters p;
  p << 0, 0, 0, decay, frequency;
  Vector r;
  Eigen::Matrix<double, Eigen::Dynamic, 5> jacobian;
  differences(s, p, r, jacobian);
  const Eigen::Matrix<double, Eigen::Dynamic, 3> linear = jacobian.leftCols<3>();
  p.head<3>() = (linear.transpose() * linear).ldlt().solve(linear.transpose() * s.y);
  return p;
}

/// The best of the frequencies up to half of the samples' rate.
Parameters search(const Samples& s) {
  const double length = s.t[s.t.size() - 1],
               highest = std::numbers::pi * static_cast<double>(s.t.size() - 1) / length,
               apart = std::numbers::pi / 2 / length;
  Parameters best;
  double least = HUGE_VAL;
  for (double w = 2 * std::numbers::pi / length; w < highest; w += apart) {
    const Parameters p = best_amplitudes(s, start_decay * w, w);
    const double sum = squares(s, p);
    if (sum < least) {
      least = sum;
      best = p;
    }
  }
  if (!std::isfinite(least))
    throw Error("no frequency fits the swing");
  return best;
}

void descend(const Samples& s, Parameters& p, Eigen::Matrix<double, 5, 5>& normal) {
  Vector r;
  Eigen::Matrix<double, Eigen::Dynamic, 5> jacobian;
  double mu = 1e-3;
  for (int round = 0; round < 200; ++round) {
    differences(s, p, r, jacobian);
    normal = jacobian.transpose() * jacobian;
    const double sum = r.squaredNorm();
    bool better = false;
    for (; mu < 1e12 && !better; mu *= better ? 0.1 : 10) {
      Eigen::Matrix<double, 5, 5> raised = normal;
      raised.diagonal() *= 1 + mu;
      const Parameters step = raised.ldlt().solve(jacobian.transpose() * r);
      const double there = squares(s, p + step);
      better = there <= sum;
      if (better) {
        p += step;
        if (!(sum - there > 1e-14 * s.variance) && step.norm() <= 1e-9 * p.norm())
          return;
      }
    }
    if (!better)
      return;
    mu = std::max(mu, 1e-12);
  }
}

} // namespace

SwingFit fit_swing(std::span<const double> times, std::span<const double> values) {
  if (times.size() < fewest)
    throw Error(std::to_string(times.size()) + " samples of a swing, expected " +
                std::to_string(fewest) + " at least");
  for (std::size_t k = 1; k < times.size(); ++k)
    if (!(times[k] > times[k - 1]))
      throw Error("sample " + std::to_string(k + 1) + " of the swing, at " +
                  text::rounded_text(times[k]) +
                  " s, is not after the one before, expected ascending times");
  const auto count = static_cast<Eigen::Index>(times.size());
  Samples s;
  s.t = Eigen::Map<const Vector>(times.data(), count).array() - times[0];
  s.y = Eigen::Map<const Vector>(values.data(), count);
  s.variance = (s.y.array() - s.y.mean()).square().sum();
  if (!(s.variance > 0))
    throw Error("the samples of the swing are all alike");
  Parameters p = search(s);
  Eigen::Matrix<double, 5, 5> normal;
  descend(s, p, normal);
  const double sum = squares(s, p), two_pi = 2 * std::numbers::pi;
  SwingFit fit;
  fit.explained = 1 - sum / s.variance;
  fit.frequency = std::abs(p[4]) / two_pi;
  if (!(fit.explained >= least_explained))
    throw Error("no swing that dies away is in the samples: the best one, of " +
                text::rounded_text(fit.frequency) + " Hz, explains " +
                text::rounded_text(100 * fit.explained) + " % of their variance, expected " +
                text::rounded_text(100 * least_explained) + " at least");
  const double swings = fit.frequency * s.t[count - 1];
  if (!(swings >= fewest_swings))
    throw Error("the samples hold " + text::rounded_text(swings) + " swings, expected " +
                text::rounded_text(fewest_swings) + " at least");
  if (!(p[3] > 0))
    throw Error("the swing does not die away, expected one that does");
  const double w = std::hypot(p[3], p[4]);
  fit.ratio = p[3] / w;
  fit.rest = p[0];
  fit.amplitude = std::hypot(p[1], p[2]);
  const double freedom = static_cast<double>(count - 5);
  const Eigen::Matrix<double, 5, 5> covariance =
      sum / freedom * normal.ldlt().solve(Eigen::Matrix<double, 5, 5>::Identity());
  const double t = numeric::student_t_quantile(0.025, static_cast<std::uint64_t>(count - 5));
  const double wide = t * std::sqrt(covariance(4, 4)) / two_pi;
  fit.frequency_interval = {fit.frequency - wide, fit.frequency + wide};
  // of Z by decay rate and frequency
  const double by_decay = p[4] * p[4] / (w * w * w), by_frequency = -p[3] * p[4] / (w * w * w);
  const double spread = t * std::sqrt(by_decay * by_decay * covariance(3, 3) +
                                      2 * by_decay * by_frequency * covariance(3, 4) +
                                      by_frequency * by_frequency * covariance(4, 4));
  fit.ratio_interval = {fit.ratio - spread, fit.ratio + spread};
  return fit;
}

} // namespace gewebe::fit
