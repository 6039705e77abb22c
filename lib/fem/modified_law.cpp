#include "fem/matrix3_internal.h"
#include "fem/modified_law_internal.h"
#include "numeric/logarithm.h"
#include "numeric/power.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace gewebe::fem {

namespace {

using Vector9 = Eigen::Matrix<double, 9, 1>;

// Where the laws end and their extensions begin (fem/hyperelastic.h).
constexpr double least_volume = 0.1, least_square = 1e-4, least_trace = 0.64, collapse = 20;

/// A function of one number with two derivatives.
struct Curve {
  double value = 0, slope = 0, second = 0;
};

Curve power_curve(double x, double exponent) {
  const double value = numeric::power(x, exponent);
  return {value, exponent * value / x, exponent * (exponent - 1) * value / (x * x)};
}

/// J^exponent; below least_volume its Taylor polynomial of degree 2 from there. \pre exponent < 0
Curve volume_factor(double j, double exponent) {
  const Curve there = power_curve(std::max(j, least_volume), exponent);
  if (j >= least_volume)
    return there;
  const double t = j - least_volume;
  return {there.value + t * (there.slope + t / 2 * there.second), there.slope + t * there.second,
          there.second};
}

/// c^a; below least_square the cubic with the same two derivatives there and slope 0 at c = 0.
/// \pre a > 0
Curve square_power(double c, double a) {
  const Curve there = power_curve(std::max(c, least_square), a);
  if (c >= least_square)
    return there;
  const double t = c / least_square - 1, k = a * (a - 2) / 3, w = there.value;
  return {w * (1 + t * (a + t * (a * (a - 1) / 2 + t * k))),
          w / least_square * (a + t * (a * (a - 1) + 3 * t * k)),
          w / (least_square * least_square) * (a * (a - 1) + 6 * t * k)};
}

/// (f'(x) - f'(y)) / (x - y) of f = square_power, also where x and y are close or equal: the mean
/// of f'' by Gauss's five points.
double slope_difference(double x, double y, double a) {
  if (std::abs(x - y) > std::max(x, y) / 32)
    return (square_power(x, a).slope - square_power(y, a).slope) / (x - y);
  constexpr std::array<std::array<double, 2>, 5> points{
      {{-0.906179845938663993, 0.118463442528094544},
       {-0.538469310105683091, 0.239314335249683234},
       {0, 0.284444444444444444},
       {0.538469310105683091, 0.239314335249683234},
       {0.906179845938663993, 0.118463442528094544}}};
  double sum = 0;
  for (const auto& [at, weight] : points)
    sum += weight * square_power((x + y) / 2 + at * (x - y) / 2, a).second;
  return sum;
}

/// A function of F.
struct Invariant {
  double value = 0;
  Vector9 slope;
  SecondDerivative second; ///< if requested
};

class Law {
public:
  Law(const SolidBlock& f, const SolidBlock& cofactor, double j, bool wants_second,
      LawResponse& response)
      : f_(matrix(f)), by_rows_(f.data()), cofactor_(cofactor.data()), f_block_(f), j_(j),
        wants_second_(wants_second), to_(response), c_(f_.transpose() * f_) {
    to_.energy = 0;
    to_.stress.fill(0);
    if (wants_second_)
      to_.second.setZero();
  }

  /// tr C
  Invariant first() const {
    Invariant q{by_rows_.squaredNorm(), 2 * by_rows_, {}};
    if (wants_second_)
      q.second = 2 * SecondDerivative::Identity();
    return q;
  }

  /// ((tr C)² - tr C²) / 2
  Invariant second() const {
    const double trace = c_.trace();
    const Matrix3 slope = 2 * (trace * f_ - f_ * c_), b = f_ * f_.transpose();
    Invariant q{
        (trace * trace - c_.squaredNorm()) / 2, Eigen::Map<const Vector9>(slope.data()), {}};
    if (!wants_second_)
      return q;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 3; ++k)
          for (int l = 0; l < 3; ++l)
            q.second(3 * i + j, 3 * k + l) =
                2 * ((i == k && j == l ? trace : 0) + 2 * f_(i, j) * f_(k, l) -
                     f_(i, l) * f_(k, j) - (i == k ? c_(j, l) : 0) - (j == l ? b(i, k) : 0));
    return q;
  }

  /// Of eigenvalues c of C: Σ c_i^(alpha/2) where alpha > 0, else Σ (c_j c_k)^(-alpha/2) over
  /// pairs, which is the same sum where c1 c2 c3 = 1.
  Invariant sum_of_powers(double alpha) {
    if (!has_axes_)
      find_axes();
    const double a = std::abs(alpha) / 2;
    Invariant q;
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();
    Matrix3 second = Matrix3::Zero();
    std::array<double, 3> differences{}; // (slope_i - slope_j) / (c_i - c_j) by the third axis k
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      const auto at = static_cast<std::size_t>(k);
      if (alpha > 0) {
        const Curve w = square_power(value_[k], a);
        q.value += w.value;
        slope[k] += w.slope;
        second(k, k) += w.second;
        if (wants_second_)
          differences[at] = slope_difference(value_[i], value_[j], a);
      } else {
        const Curve w = square_power(value_[i] * value_[j], a);
        q.value += w.value;
        slope[i] += value_[j] * w.slope;
        slope[j] += value_[i] * w.slope;
        second(i, i) += value_[j] * value_[j] * w.second;
        second(j, j) += value_[i] * value_[i] * w.second;
        second(i, j) += w.slope + value_[i] * value_[j] * w.second;
        second(j, i) = second(i, j);
        if (wants_second_)
          differences[at] = value_[k] * value_[k] *
                                slope_difference(value_[i] * value_[k], value_[j] * value_[k], a) -
                            w.slope;
      }
    }
    // dQ/dF = F S, S = 2 dQ/dC.
    const Matrix3 s = 2 * axes_ * slope.asDiagonal() * axes_.transpose(), p = f_ * s;
    q.slope = Eigen::Map<const Vector9>(p.data());
    if (!wants_second_)
      return q;
    // In the axes, with E = dC: d²Q = dF S : dF + Σ Q_ij E_ii E_jj + Σ_i≠j differences E_ij².
    q.second.setZero();
    for (int i = 0; i < 3; ++i)
      q.second.block<3, 3>(3 * i, 3 * i) = s;
    const auto strain = [&](int i, int j) {
      const Matrix3 e =
          moved_.col(i) * axes_.col(j).transpose() + moved_.col(j) * axes_.col(i).transpose();
      return Vector9(Eigen::Map<const Vector9>(e.data()));
    };
    Eigen::Matrix<double, 9, 3> along;
    for (int k = 0; k < 3; ++k) {
      along.col(k) = strain(k, k);
      const Vector9 across = strain((k + 1) % 3, (k + 2) % 3);
      q.second += 2 * differences[static_cast<std::size_t>(k)] * across * across.transpose();
    }
    q.second += along * second * along.transpose();
    return q;
  }

  /// X = J^exponent Q.
  Invariant modified(const Invariant& q, double exponent) const {
    const Curve h = volume_factor(j_, exponent);
    Invariant x{h.value * q.value, h.value * q.slope + h.slope * q.value * cofactor_, {}};
    if (!wants_second_)
      return x;
    const SecondDerivative cross = q.slope * cofactor_.transpose();
    x.second = h.value * q.second + h.slope * (cross + cross.transpose()) +
               h.second * q.value * cofactor_ * cofactor_.transpose();
    add_cofactor_slope(f_block_, h.slope * q.value, x.second);
    return x;
  }

  /// W += w(x).
  void add(const Curve& w, const Invariant& x) {
    to_.energy += w.value;
    Eigen::Map<Vector9>(to_.stress.data()) += w.slope * x.slope;
    if (wants_second_)
      to_.second += w.slope * x.second + w.second * x.slope * x.slope.transpose();
  }

  /// W += factor (x - 3).
  void add(double factor, const Invariant& x) { add({factor * (x.value - 3), factor, 0}, x); }

  /// mu/3 (J - 1)², and what keeps elements from collapsing.
  void add_common(double mu) {
    Invariant x{j_, cofactor_, {}};
    if (wants_second_) {
      x.second.setZero();
      add_cofactor_slope(f_block_, 1, x.second);
    }
    const double off = j_ - 1;
    add({mu / 3 * off * off, 2 * mu / 3 * off, 2 * mu / 3}, x);
    const Invariant i_c = first();
    const double lost = 1 - i_c.value / least_trace, k = collapse * mu;
    if (lost > 0)
      add({k * lost * lost * lost, -3 * k / least_trace * lost * lost,
           6 * k / (least_trace * least_trace) * lost},
          i_c);
  }

private:
  void find_axes() {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(c_);
    axes_ = solver.eigenvectors();
    value_ = solver.eigenvalues().cwiseMax(0);
    moved_ = f_ * axes_;
    has_axes_ = true;
  }

  Matrix3 f_;
  Eigen::Map<const Vector9> by_rows_, cofactor_;
  const SolidBlock& f_block_;
  double j_;
  bool wants_second_;
  LawResponse& to_;
  Matrix3 c_;
  bool has_axes_ = false; ///< and the three below
  Eigen::Vector3d value_;
  Matrix3 axes_, moved_; ///< eigenvectors of C, and F times these
};

} // namespace

void add_cofactor_slope(const SolidBlock& f, double scale, SecondDerivative& m) {
  // d²J/dF_ij dF_kl = ε_ikm ε_jln F_mn.
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (const int s : {1, 2})
        for (const int t : {1, 2}) {
          const int k = (i + s) % 3, l = (j + t) % 3, row = (i + 3 - s) % 3,
                    column = (j + 3 - t) % 3;
          m(3 * i + j, 3 * k + l) +=
              (s == t ? scale : -scale) * f[static_cast<std::size_t>(3 * row + column)];
        }
}

void modified_law(const model::HyperelasticLaw& law, double mu, const SolidBlock& f,
                  const SolidBlock& cofactor, double j, bool wants_second, LawResponse& response) {
  Law sum(f, cofactor, j, wants_second, response);
  const auto& p = law.parameter;
  if (law.kind == model::HyperelasticLaw::ogden) {
    const auto add = [&](double alpha, double share) {
      sum.add(2 * mu * share / (alpha * alpha),
              sum.modified(sum.sum_of_powers(alpha), alpha > 0 ? -alpha / 3 : 2 * alpha / 3));
    };
    add(p[0], 1 - p[2]);
    if (p[2] != 0)
      add(p[1], p[2]);
  } else {
    const Invariant x = sum.modified(sum.first(), -2.0 / 3);
    if (law.kind == model::HyperelasticLaw::yeoh) {
      const double by = x.value - 3, c10 = mu / 2, c20 = p[0] * mu, c30 = p[1] * mu;
      sum.add({by * (c10 + by * (c20 + by * c30)), c10 + by * (2 * c20 + 3 * by * c30),
               2 * c20 + 6 * by * c30},
              x);
    } else {
      const double c01 = p[0] * mu;
      sum.add(mu / 2 - c01, x);
      sum.add(c01, sum.modified(sum.second(), -4.0 / 3));
    }
  }
  sum.add_common(mu);
}

bool is_neo_hookean(const model::HyperelasticLaw& law) {
  return law.kind == model::HyperelasticLaw::stable_neo_hookean ||
         law.kind == model::HyperelasticLaw::neo_hookean;
}

NeoHookeanLaw neo_hookean_law(const model::HyperelasticLaw& law, double mu, double i_c, double j) {
  if (law.kind == model::HyperelasticLaw::neo_hookean) {
    if (!(j > 0))
      return {.energy = HUGE_VAL};
    return {mu / 2 * (i_c - 3) - mu * numeric::natural_logarithm(j), mu, 0, mu / (j * j), -mu / j};
  }
  const double shear = 2.0 / 3 * mu, below = i_c + 1;
  return {shear * (i_c - 3) - shear * numeric::natural_logarithm(below / 4) - mu * (j - 1) +
              5.0 / 12 * mu * (j - 1) * (j - 1),
          2 * shear * (1 - 1 / below), 4 * shear / (below * below), 5.0 / 6 * mu,
          -mu + 5.0 / 6 * mu * (j - 1)};
}

void law_at(const model::HyperelasticLaw& law, double mu, const SolidBlock& f,
            const SolidBlock& cofactor, double j, bool wants_second, LawResponse& response) {
  if (!is_neo_hookean(law)) {
    modified_law(law, mu, f, cofactor, j, wants_second, response);
    return;
  }
  double i_c = 0;
  for (const double value : f)
    i_c += value * value;
  const NeoHookeanLaw w = neo_hookean_law(law, mu, i_c, j);
  response.energy = w.energy;
  for (std::size_t k = 0; k < 9; ++k)
    response.stress[k] = w.a * f[k] + w.d * cofactor[k];
  if (!wants_second)
    return;
  const Eigen::Map<const Vector9> by_rows(f.data()), of_j(cofactor.data());
  response.second = SecondDerivative::Identity() * w.a;
  response.second += w.b * by_rows * by_rows.transpose() + w.c * of_j * of_j.transpose();
  add_cofactor_slope(f, w.d, response.second);
}

void remember(const ElementMemory& memory, std::size_t n, double mu, const SolidBlock& f,
              const SolidBlock& cofactor, double j, bool wants_second, LawResponse& response) {
  const double left = 1 - memory.share, off = j - 1;
  const auto& [xx, yy, zz, xy, yz, zx] = memory.stress[n];
  Matrix3 a;
  a << xx, xy, zx, xy, yy, yz, zx, yz, zz;
  const Matrix3 deformation = matrix(f), p = deformation * a;
  const Eigen::Map<const Vector9> of_history(p.data()), of_j(cofactor.data());
  Eigen::Map<Vector9> stress(response.stress.data());
  const Matrix3 c = deformation.transpose() * deformation - Matrix3::Identity();
  response.energy =
      memory.share * response.energy + left * mu / 3 * off * off + a.cwiseProduct(c).sum() / 2;
  stress = memory.share * stress + left * 2 * mu / 3 * off * of_j + of_history;
  if (!wants_second)
    return;
  response.second = memory.share * response.second + left * 2 * mu / 3 * of_j * of_j.transpose();
  add_cofactor_slope(f, left * 2 * mu / 3 * off, response.second);
  for (int i = 0; i < 3; ++i)
    response.second.block<3, 3>(3 * i, 3 * i) += a;
}

} // namespace gewebe::fem
