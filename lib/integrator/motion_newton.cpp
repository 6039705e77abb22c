#include "base/error.h"
#include "fem/mixed_solid.h"
#include "geometry/vector_at.h"
#include "integrator/motion_descent_internal.h"
#include "linalg/factor.h"
#include "numeric/logarithm.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::integrator {

namespace {

/// Smallest part of a step.
constexpr double least_part = 1e-6;
/// Factors that a shape may take.
constexpr int max_factors = 60;
/// Shares of positive parts that are tried where a shape isn't stable.
constexpr std::array<double, 4> positive_shares{0, 1.0 / 16, 1.0 / 4, 1};
/// Steps that acceleration looks back on.
constexpr std::size_t looks_back = 6;
/// Smallest displacement that errors count against, over the size of the body.
constexpr double least_displacement = 1e-9;

/// A point, or a step between two.
struct Mixed {
  Numbers at;
  fem::MixedUnknowns own;
};

void add(Mixed& to, double factor, const Mixed& of) {
  gewebe::integrator::add(to.at, factor, of.at);
  for (std::size_t t = 0; t < to.own.bubble.size(); ++t) {
    to.own.bubble[t] += factor * of.own.bubble[t];
    for (std::size_t p = 0; p < 4; ++p)
      to.own.pressure[t][p] += factor * of.own.pressure[t][p];
  }
}

double length(const Mixed& step) {
  return std::sqrt(product(step.at, step.at));
}

/// What following forces are with nodes at these places is added to `forces`.
void add_following(std::span<const FollowingForce> following, std::span<const double> at,
                   std::span<double> forces) {
  for (const FollowingForce& f : following) {
    const auto [a, b, c] = f.triangle;
    const Vec3 corner = vector_at(at, a),
               force = f.factor * cross(vector_at(at, b) - corner, vector_at(at, c) - corner);
    for (int i = 0; i < 3; ++i)
      forces[axis_of(f.node, i)] += force[i];
  }
}

/// Adds to the entry of two axes of a symmetric matrix, if both are free.
void add_entry(linalg::StiffnessMatrix& matrix, std::size_t axis, std::size_t other, double value) {
  const std::int64_t i = matrix.row_of_axis[axis], j = matrix.row_of_axis[other];
  if (i < 0 || j < 0)
    return;
  const auto column = static_cast<std::size_t>(std::min(i, j));
  const auto begin = matrix.row.begin() + matrix.column_start[column],
             end = matrix.row.begin() + matrix.column_start[column + 1],
             entry = std::lower_bound(begin, end, std::max(i, j));
  if (entry != end && *entry == std::max(i, j))
    matrix.value[static_cast<std::size_t>(entry - matrix.row.begin())] += value;
}

/// Subtracts from a matrix the symmetric part of the derivative of following forces. For an even
/// pressure on a closed surface, or one with a held border, the rest is small: it comes from the
/// corners of quadratic faces alone, whose forces act on the middles.
void take_following(std::span<const FollowingForce> following, std::span<const double> at,
                    linalg::StiffnessMatrix& matrix) {
  for (const FollowingForce& f : following)
    for (std::size_t k = 0; k < 3; ++k) {
      // By the corner k the force changes by the opposite side times its displacement.
      const std::uint32_t node = f.triangle[k];
      const Vec3 side =
          vector_at(at, f.triangle[(k + 2) % 3]) - vector_at(at, f.triangle[(k + 1) % 3]);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          if (i == j)
            continue;
          // side x d, by component
          const int third = 3 - i - j;
          const double sign = (j - i + 3) % 3 == 2 ? 1 : -1, change = f.factor * sign * side[third];
          const std::size_t row = axis_of(f.node, i), column = axis_of(node, j);
          // Half of it, and half of its transpose, which the entry stands for: within a node the
          // halves cancel.
          add_entry(matrix, row, column, -change / 2);
        }
    }
}

class RestNewton {
public:
  RestNewton(const MotionObjective& objective, const Numbers& target,
             std::span<const FollowingForce> following, MotionQuick& quick, MotionTangent& tangent,
             SolidStep& step, const Context& context)
      : objective_(objective), target_(target), following_(following), quick_(quick),
        tangent_(tangent), step_(step), context_(context),
        solid_(objective.body().mesh, objective.body().elements) {}

  Mixed start(const Numbers& at) const {
    return {at, solid_.balanced(displacement(at), {}, context_)};
  }
  /// Whether the last system was factorised, and isn't that at rest.
  bool exact() const { return exact_; }
  /// Whether the last system is of a shape from which the energy rises.
  bool is_stable() const { return share_ == 0; }
  /// Unbalanced forces of the last right-hand side.
  const Numbers& forces() const { return forces_; }
  double displaced(const Numbers& at) const {
    const Numbers u = displacement(at);
    const Numbers& rest = objective_.body().rest;
    return std::max(std::sqrt(product(u, u)), least_displacement * std::sqrt(product(rest, rest)));
  }

  /// Builds the system at x; its solution.
  Mixed linearise(const Mixed& x) {
    const Numbers u = displacement(x.at);
    if (std::ranges::all_of(u, [](double by) { return by == 0; })) {
      value_ = solid_.linearise(u, x.own, 0, context_);
      exact_ = false;
    } else {
      factorise(u, x);
    }
    value_ -= work_of_load(objective_.body(), objective_.state().load, x.at);
    unsure_ = objective_.energy().unsure_at_rest() + 1e-13 * std::abs(value_);
    return solve(x.at);
  }
  /// The solution of the system with the right-hand side at x.
  Mixed correct(const Mixed& x) {
    here_ = solid_.evaluate(displacement(x.at), x.own, context_) -
            work_of_load(objective_.body(), objective_.state().load, x.at);
    if (!std::isfinite(here_))
      return {};
    return solve(x.at);
  }
  /// A step along the solution at x, at first of this part of it, that passes. \param x, by  become
  /// the point and the correction there \param part  that was taken; of none 0
  void take_step(Mixed& x, Mixed& by, double& part) {
    const double whole = length(by), slope = slope_;
    const bool downhill = following_.empty() && !moves_held(x.at);
    while (part > least_part) {
      Mixed next = x;
      add(next, part, by);
      if (part == 1)
        reach_target(next.at);
      Mixed correction = correct(next);
      const bool is_near = length(correction) <= (1 - part / 4) * whole;
      if (!correction.at.empty() &&
          (is_near || (downhill && here_ <= value_ - 1e-4 * part * slope + unsure_))) {
        x = std::move(next);
        by = std::move(correction);
        return;
      }
      part /= 2;
    }
    part = 0;
  }
  /// Held axes are where they are to be, to the bit.
  void reach_target(Numbers& at) const {
    for (std::size_t axis = 0; axis < at.size(); ++axis)
      if (objective_.state().held[axis] != 0)
        at[axis] = target_[axis];
  }

private:
  Numbers displacement(const Numbers& at) const {
    Numbers u = at;
    gewebe::integrator::add(u, -1, objective_.body().rest);
    return u;
  }
  bool moves_held(const Numbers& at) const {
    for (std::size_t axis = 0; axis < at.size(); ++axis)
      if (objective_.state().held[axis] != 0 && at[axis] != target_[axis])
        return true;
    return false;
  }

  void factorise(const Numbers& u, const Mixed& x) {
    exact_ = true;
    // What the last shape needed is needed again, or the next smaller one is enough.
    for (std::size_t k = share_ > 0 ? share_ - 1 : 0; k < positive_shares.size(); ++k) {
      const double positive = positive_shares[k];
      value_ = solid_.linearise(u, x.own, positive, context_);
      ++step_.factorisations;
      try {
        linalg::StiffnessMatrix matrix = solid_.matrix(objective_.state().held, context_);
        take_following(following_, x.at, matrix);
        tangent_.make(std::move(matrix), context_);
        share_ = k;
        return;
      } catch (const linalg::NotPositiveDefinite&) {
        if (positive == 1)
          throw;
      }
    }
  }

  Mixed solve(const Numbers& at) {
    ++step_.rounds;
    const MotionState& state = objective_.state();
    Numbers forces = state.load, way(at.size());
    bool moves = false;
    for (std::size_t axis = 0; axis < at.size(); ++axis)
      if (state.held[axis] != 0 && at[axis] != target_[axis]) {
        way[axis] = target_[axis] - at[axis];
        moves = true;
      }
    add_following(following_, at, forces);
    solid_.add_forces(forces);
    if (moves)
      solid_.take_product(way, forces);
    for (std::size_t axis = 0; axis < at.size(); ++axis)
      if (state.held[axis] != 0)
        forces[axis] = 0;
    Mixed by;
    by.at = forces_ = forces;
    if (exact_)
      tangent_.solve(by.at);
    else
      quick_.solve_at_rest(by.at);
    slope_ = product(forces, by.at);
    if (moves)
      gewebe::integrator::add(by.at, 1, way);
    by.own = solid_.follow(by.at, context_);
    return by;
  }

  const MotionObjective& objective_;
  const Numbers& target_;
  std::span<const FollowingForce> following_;
  MotionQuick& quick_;
  MotionTangent& tangent_;
  SolidStep& step_;
  const Context& context_;
  fem::MixedSolid solid_;
  bool exact_ = false;
  Numbers forces_;
  std::size_t share_ = 0;       ///< of positive_shares, in the last matrix
  double value_ = 0, here_ = 0; ///< of the system's point; of the last one
  double unsure_ = 0, slope_ = 0;
};

/// Anderson's mixing of the last corrections (Anderson, Iterative procedures for nonlinear integral
/// equations, J. ACM 12, 1965): to what would be left of them by linear combinations.
class Acceleration {
public:
  /// The point behind x, with the correction `by` there.
  Mixed next(const Mixed& x, const Mixed& by) {
    Mixed ahead = x;
    add(ahead, 1, by);
    const std::size_t count = points_.size();
    if (count > 0) {
      std::vector<Mixed> turned(count, by);
      for (std::size_t k = 0; k < count; ++k)
        add(turned[k], -1, corrections_[k]);
      const auto order = static_cast<Eigen::Index>(count);
      Eigen::MatrixXd products(order, order);
      Eigen::VectorXd along(order);
      for (std::size_t k = 0; k < count; ++k) {
        const auto row = static_cast<Eigen::Index>(k);
        along[row] = product(turned[k].at, by.at);
        for (std::size_t m = 0; m <= k; ++m)
          products(row, static_cast<Eigen::Index>(m)) =
              products(static_cast<Eigen::Index>(m), row) = product(turned[k].at, turned[m].at);
      }
      products.diagonal() *= 1 + 1e-12;
      const Eigen::VectorXd share = products.ldlt().solve(along);
      for (std::size_t k = 0; k < count && share.allFinite(); ++k) {
        const double by_share = share[static_cast<Eigen::Index>(k)];
        add(ahead, -by_share, x);
        add(ahead, by_share, points_[k]);
        add(ahead, -by_share, turned[k]);
      }
    }
    if (count == looks_back) {
      points_.erase(points_.begin());
      corrections_.erase(corrections_.begin());
    }
    points_.push_back(x);
    corrections_.push_back(by);
    return ahead;
  }

private:
  std::vector<Mixed> points_, corrections_;
};

/// Rounds with the matrix that is there, from x and its correction. \return whether what is left is
/// within the tolerance
bool finish(RestNewton& newton, Mixed& x, Mixed& by, double before, double worth,
            const SolidMotionOptions& options, SolidStep& step) {
  Acceleration acceleration;
  while (step.rounds < options.max_rounds) {
    const double now = length(by);
    step.change = step.left = now / newton.displaced(x.at);
    if (step.left <= options.tolerance) {
      if (!newton.is_stable())
        return false; // on the way from a saddle
      add(x, 1, by);
      newton.reach_target(x.at);
      return true;
    }
    const double rate = now / before;
    if (!(rate < 1) || numeric::natural_logarithm(options.tolerance / step.left) /
                               numeric::natural_logarithm(rate) >
                           worth)
      return false;
    Mixed next = acceleration.next(x, by);
    newton.reach_target(next.at);
    const Numbers forces = newton.forces();
    Mixed correction = newton.correct(next);
    if (correction.at.empty() || !(length(correction) < now))
      return false;
    double curvature = 0; // of the energy along the round
    for (std::size_t axis = 0; axis < forces.size(); ++axis)
      curvature += (next.at[axis] - x.at[axis]) * (forces[axis] - newton.forces()[axis]);
    before = now;
    x = std::move(next);
    by = std::move(correction);
    if (curvature < 0) // a saddle may be near, to which rounds with any matrix lead
      return false;
  }
  return false;
}

} // namespace

void newton_to_rest(const MotionObjective& objective, MotionPoint& now, const Numbers& target,
                    std::span<const FollowingForce> following, MotionQuick& quick,
                    MotionTangent& tangent, bool& exact, const SolidMotionOptions& options,
                    SolidStep& step, const Context& context) {
  RestNewton newton(objective, target, following, quick, tangent, step, context);
  const double worth = quick.rounds_of_tangent(objective.body());
  // Rounding of places, which no round gets below.
  const Numbers& rest = objective.body().rest;
  const double rounding = 1e-15 * std::sqrt(product(rest, rest));
  Mixed x = newton.start(now.at);
  double part = 1;
  step.left = HUGE_VAL;
  while (step.rounds < options.max_rounds && step.factorisations < max_factors) {
    if (context.cancelled && context.cancelled())
      throw Cancelled();
    Mixed by;
    try {
      by = newton.linearise(x);
    } catch (const linalg::NotPositiveDefinite&) {
      break; // what is torn far apart has no matrix in numbers of this length
    }
    const double whole = length(by);
    if (!(whole > rounding)) {
      step.change = step.left = 0;
      break;
    }
    part = std::min(1.0, 2 * part);
    newton.take_step(x, by, part);
    step.left = HUGE_VAL;
    if (part == 0 || (part == 1 && finish(newton, x, by, whole, worth, options, step)))
      break;
  }
  now.at = std::move(x.at);
  exact = newton.exact();
}

} // namespace gewebe::integrator
