#include "contact/contact_interior_internal.h"

#include "contact/contact_rank_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace gewebe {

namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double short_of = 0.99;  ///< the way to the border that a step takes
constexpr double least_part = 0.1; ///< of a step; a shorter one goes towards the centre
constexpr double no_centre = 1e-18;
constexpr Index few_rows = 48;      ///< of which a factor costs nothing
constexpr double same_rank = 3e-12; ///< of the largest compliance
constexpr double exact = 1e-13;     ///< of a row's parts, may be left of it

/// sqrt(x_n² - |x_t|²), without cancellation. \pre x in its cone
double depth_of(const Vector3d& x) {
  const double t = x.tail<2>().norm();
  return std::sqrt(std::max(0.0, (x[0] - t) * (x[0] + t)));
}

/// Nesterov and Todd's scaling of one contact: W z = W⁻¹ x.
struct Scaling {
  Matrix3d w, inverse;
  Vector3d middle; ///< W z
};

Scaling scaling_of(const Vector3d& x, const Vector3d& z) {
  const double dx = depth_of(x), dz = depth_of(z);
  const Vector3d a = x / dx, b = z / dz;
  const Vector3d v =
      Vector3d(a[0] + b[0], a[1] - b[1], a[2] - b[2]) / (2 * std::sqrt((1 + a.dot(b)) / 2));
  const double eta = std::sqrt(dx / dz);
  Matrix3d m;
  m(0, 0) = v[0];
  m.block<2, 1>(1, 0) = v.tail<2>();
  m.block<1, 2>(0, 1) = v.tail<2>().transpose();
  m.block<2, 2>(1, 1) =
      Eigen::Matrix2d::Identity() + v.tail<2>() * v.tail<2>().transpose() / (1 + v[0]);
  const Vector3d mirror(1, -1, -1);
  Scaling s;
  s.w = eta * m;
  s.inverse = mirror.asDiagonal() * m * mirror.asDiagonal() / eta;
  s.middle = s.w * z;
  return s;
}

/// The cones' product.
Vector3d product(const Vector3d& a, const Vector3d& b) {
  Vector3d c;
  c[0] = a.dot(b);
  c.tail<2>() = a[0] * b.tail<2>() + b[0] * a.tail<2>();
  return c;
}

/// x with product(a, x) = b.
Vector3d quotient(const Vector3d& b, const Vector3d& a) {
  const double d = depth_of(a);
  Vector3d x;
  x[0] = (a[0] * b[0] - a.tail<2>().dot(b.tail<2>())) / (d * d);
  x.tail<2>() = (b.tail<2>() - x[0] * a.tail<2>()) / a[0];
  return x;
}

/// The largest t with x + t d in the cone; may be infinite.
double reach(const Vector3d& x, const Vector3d& d) {
  const double a = d[0] * d[0] - d.tail<2>().squaredNorm(),
               b = x[0] * d[0] - x.tail<2>().dot(d.tail<2>()), c = depth_of(x) * depth_of(x);
  double least = d[0] < 0 ? -x[0] / d[0] : HUGE_VAL;
  const double inner = b * b - a * c;
  if (inner < 0)
    return least;
  const double q = -(b + std::copysign(std::sqrt(inner), b));
  for (const double t : {q / a, c / q})
    if (t > 0)
      least = std::min(least, t);
  return least;
}

/// The problem in x and z, of unit size.
class Centre {
public:
  Centre(const MatrixXd& w, const VectorXd& q, std::span<const double> friction)
      : w_(w), friction_(friction), size_(q.size()), scale_(VectorXd::Ones(q.size())) {
    Index row = 0;
    for (const double mu : friction) {
      first_.push_back(row);
      if (mu > 0) {
        rough_ = true;
        scale_[row] = 1 / mu;
      }
      row += mu > 0 ? 3 : 1;
    }
    largest_w_ = w.diagonal().maxCoeff();
    largest_q_ = q.cwiseAbs().maxCoeff();
    w_ = scale_.asDiagonal() * w_ * scale_.asDiagonal() / largest_w_;
    q_ = scale_.cwiseProduct(q) / largest_q_;
    x_ = z_ = VectorXd::Zero(size_);
    for (std::size_t i = 0; i < first_.size(); ++i) {
      x_[first_[i]] = z_[first_[i]] = 1;
      sizes_.push_back(rough(i) ? 3 : 1);
    }
    if (size_ >= few_rows)
      shared_ = shared_compliance(w_, size_ / 3, same_rank);
  }

  VectorXd forces() const { return largest_q_ / largest_w_ * scale_.cwiseProduct(x_); }

  /// \return false where it can't go on
  bool step() {
    const double gap = x_.dot(z_) / static_cast<double>(first_.size());
    if (!(gap > no_centre) || !x_.allFinite() || !z_.allFinite())
      return false;
    linearise(gap);
    scale();
    if (!factorise())
      return false;
    direction(0, false);
    const double part = std::min(1.0, longest());
    const double after =
        (x_ + part * dx_).dot(z_ + part * dz_) / static_cast<double>(first_.size());
    const double centring = std::clamp(std::pow(after / gap, 3), 1e-4, 1.0);
    corrected_x_ = dx_;
    corrected_z_ = dz_;
    direction(centring * gap, true);
    if (!(longest() > least_part))
      direction(0.5 * gap, false);
    return advance();
  }

private:
  bool rough(std::size_t i) const { return friction_[i] > 0; }

  /// What z misses of W x + q and the slip, and the derivative by x. The slip's size is smooth
  /// within some of the gap that is left.
  void linearise(double gap) {
    VectorXd there = w_ * x_ + q_;
    slope_ = w_;
    slip_ = VectorXd::Zero(size_);
    const double soft = std::min(1e-2, 10 * gap);
    for (std::size_t i = 0; i < first_.size(); ++i) {
      if (!rough(i))
        continue;
      const Index k = first_[i];
      const Vector2d slip = there.segment<2>(k + 1);
      const double size = std::sqrt(slip.squaredNorm() + soft * soft);
      there[k] += size - soft;
      slip_.segment<2>(k + 1) = slip / size;
      slope_.row(k) += slip.transpose() / size * w_.middleRows(k + 1, 2);
    }
    missing_ = there - z_;
  }

  void scale() {
    scaling_.resize(first_.size());
    for (std::size_t i = 0; i < first_.size(); ++i)
      if (rough(i))
        scaling_[i] = scaling_of(x_.segment<3>(first_[i]), z_.segment<3>(first_[i]));
  }

  bool factorise() {
    solver_.reset();
    if (!shared_)
      return factorise_whole();
    std::vector<Matrix3d> slips(first_.size(), Matrix3d::Identity()), own(first_.size());
    for (std::size_t i = 0; i < first_.size(); ++i) {
      if (rough(i)) {
        slips[i].block<1, 2>(0, 1) = slip_.segment<2>(first_[i] + 1).transpose();
        own[i] = scaling_[i].inverse * scaling_[i].inverse;
      } else {
        own[i](0, 0) = z_[first_[i]] / x_[first_[i]];
      }
    }
    solver_.emplace(*shared_, slope_, first_, sizes_, slips, own);
    return true;
  }

  bool factorise_whole() {
    MatrixXd m = slope_;
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const Index k = first_[i];
      if (rough(i))
        m.block<3, 3>(k, k) += scaling_[i].inverse * scaling_[i].inverse;
      else
        m(k, k) += z_[k] / x_[k];
    }
    if (rough_)
      lu_.compute(m);
    else
      llt_.compute(m);
    return rough_ || llt_.info() == Eigen::Success;
  }

  /// Towards x z = target, with the second order of the last direction or without.
  void direction(double target, bool corrected) {
    VectorXd rhs(size_);
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const Index k = first_[i];
      if (rough(i)) {
        const Scaling& s = scaling_[i];
        Vector3d wanted = -product(s.middle, s.middle);
        wanted[0] += target;
        if (corrected)
          wanted -=
              product(s.inverse * corrected_x_.segment<3>(k), s.w * corrected_z_.segment<3>(k));
        rhs.segment<3>(k) = s.inverse * quotient(wanted, s.middle);
      } else {
        const double second = corrected ? corrected_x_[k] * corrected_z_[k] : 0;
        rhs[k] = (target - x_[k] * z_[k] - second) / x_[k];
      }
    }
    rhs -= missing_;
    dx_ = solved(rhs);
    dz_ = slope_ * dx_ + missing_;
  }

  VectorXd solved(const VectorXd& rhs) {
    if (solver_) {
      if (std::optional<VectorXd> x = solver_->solve(rhs, exact))
        return *std::move(x);
      solver_.reset();
      if (!factorise_whole())
        return VectorXd::Constant(size_, NAN);
    }
    return rough_ ? VectorXd(lu_.solve(rhs)) : VectorXd(llt_.solve(rhs));
  }

  double longest() const {
    double most = HUGE_VAL;
    for (std::size_t i = 0; i < first_.size(); ++i) {
      const Index k = first_[i];
      if (rough(i)) {
        most = std::min({most, reach(x_.segment<3>(k), dx_.segment<3>(k)),
                         reach(z_.segment<3>(k), dz_.segment<3>(k))});
        continue;
      }
      if (dx_[k] < 0)
        most = std::min(most, -x_[k] / dx_[k]);
      if (dz_[k] < 0)
        most = std::min(most, -z_[k] / dz_[k]);
    }
    return most;
  }

  bool advance() {
    if (!dx_.allFinite() || !dz_.allFinite())
      return false;
    const double part = std::min(1.0, short_of * longest());
    x_ += part * dx_;
    z_ += part * dz_;
    return true;
  }

  MatrixXd w_;
  std::span<const double> friction_;
  Index size_;
  VectorXd scale_, q_, x_, z_, dx_, dz_, corrected_x_, corrected_z_, missing_;
  std::vector<Index> first_, sizes_; ///< rows of each contact
  bool rough_ = false;
  double largest_w_ = 0, largest_q_ = 0;
  MatrixXd slope_;
  VectorXd slip_;                          ///< directions, behind each contact's first row
  std::optional<SharedCompliance> shared_; ///< where the contacts share most of it
  std::optional<SharedSolver> solver_;
  std::vector<Scaling> scaling_;
  Eigen::PartialPivLU<MatrixXd> lu_;
  Eigen::LLT<MatrixXd> llt_;
};

} // namespace

bool follow_contact_centre(const MatrixXd& w, const VectorXd& q, std::span<const double> friction,
                           int max_steps, const std::function<bool(const VectorXd&)>& done) {
  if (friction.empty() || !w.allFinite() || !q.allFinite() || !(w.diagonal().maxCoeff() > 0) ||
      !(q.cwiseAbs().maxCoeff() > 0))
    return false;
  Centre centre(w, q, friction);
  for (int k = 0; k < max_steps; ++k) {
    if (!centre.step())
      return false;
    if (done(centre.forces()))
      return true;
  }
  return false;
}

} // namespace gewebe
