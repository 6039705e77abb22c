#include "contact/contact_pushes.h"

#include "contact/contact_interior_internal.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

// Based on: J. Júdice, F. Pires, A block principal pivoting algorithm for large-scale strictly
// monotone linear complementarity problems, 1994.

namespace gewebe {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int max_inner = 60; ///< steps along the centre

using Square = Eigen::Map<const MatrixXd>;
using Column = Eigen::Map<const VectorXd>;

struct Pushes {
  VectorXd lambda, g; ///< pushes, and the gaps under them
};

/// λ >= 0, g = b + A λ >= 0, λ g = 0. \param on in: a guess of where λ > 0
std::optional<Pushes> pivot(const Square& a, const Column& b, std::vector<char> on) {
  const Index count = b.size();
  const double slack = 1e-14 * b.cwiseAbs().maxCoeff();
  VectorXd lambda = VectorXd::Zero(count), g(count), part;
  MatrixXd within;
  std::vector<Index> set;
  set.reserve(on.size());
  Index best = count + 1;
  int patience = 3;
  const auto is_wrong = [&](Index i) {
    return on[static_cast<std::size_t>(i)] != 0 ? lambda[i] < 0 : g[i] < -slack;
  };
  for (Index round = 0; round < 10 * count + 100; ++round) {
    set.clear();
    for (Index i = 0; i < count; ++i)
      if (on[static_cast<std::size_t>(i)] != 0)
        set.push_back(i);
    lambda.setZero();
    if (!set.empty()) {
      const auto size = std::ssize(set);
      within.resize(size, size);
      part.resize(size);
      for (Index c = 0; c < size; ++c) {
        const double* const from = a.col(set[static_cast<std::size_t>(c)]).data();
        double* const to = within.col(c).data();
        for (std::size_t r = 0; r < set.size(); ++r)
          to[r] = from[set[r]];
        part[c] = -b[set[static_cast<std::size_t>(c)]];
      }
      const Eigen::LLT<Eigen::Ref<MatrixXd>> factor(within); // in place
      if (factor.info() != Eigen::Success)
        return std::nullopt;
      factor.solveInPlace(part);
      for (Index c = 0; c < size; ++c)
        lambda[set[static_cast<std::size_t>(c)]] = part[c];
    }
    g.noalias() = a * lambda;
    g += b;
    Index wrong = 0, last = -1;
    for (Index i = 0; i < count; ++i)
      if (is_wrong(i)) {
        ++wrong;
        last = i;
      }
    if (wrong == 0)
      return Pushes{std::move(lambda), std::move(g)};
    if (!lambda.allFinite())
      return std::nullopt;
    // All that are wrong change sides while that helps, else the last one (which must end).
    if (wrong < best) {
      best = wrong;
      patience = 3;
    } else {
      --patience;
    }
    for (Index i = 0; i < count; ++i)
      if (auto& own = on[static_cast<std::size_t>(i)]; (patience > 0 || i == last) && is_wrong(i))
        own = own != 0 ? 0 : 1;
  }
  return std::nullopt;
}

double residual_of(const Square& a, const VectorXd& lambda, const VectorXd& g) {
  double scale = 0, miss = 0;
  for (Index i = 0; i < lambda.size(); ++i) {
    const double push = std::max(0.0, lambda[i] - g[i] / a(i, i));
    const double here = std::abs(lambda[i] - push);
    scale = std::max({scale, std::abs(lambda[i]), push});
    miss = here <= miss ? miss : here;
  }
  return scale > 0 ? miss / scale : miss;
}

} // namespace

PushForces solve_pushes(std::span<const double> compliance, std::span<const double> gap,
                        std::span<const double> start) {
  PushForces result;
  const auto count = static_cast<Index>(gap.size());
  if (count == 0) {
    result.solved = true;
    return result;
  }
  const Square a(compliance.data(), count, count);
  const Column b(gap.data(), count);
  std::vector<char> on(gap.size(), 0);
  std::ranges::transform(start, on.begin(), [](double push) { return push > 0 ? 1 : 0; });
  if (std::ranges::none_of(on, [](char o) { return o != 0; }))
    std::ranges::transform(gap, on.begin(), [](double of) { return of < 0 ? 1 : 0; });
  VectorXd lambda = VectorXd::Zero(count);
  result.residual = HUGE_VAL;
  const auto take = [&](VectorXd&& some, const VectorXd& g) {
    const double residual = residual_of(a, some, g);
    if (!(residual < result.residual))
      return;
    lambda = std::move(some);
    result.residual = residual;
  };
  if (std::optional<Pushes> found = pivot(a, b, std::move(on)))
    take(std::move(found->lambda), found->g);
  if (!(result.residual <= contact_solver_tolerance)) {
    const std::vector<double> smooth(gap.size());
    follow_contact_centre(a, b, smooth, max_inner, [&](const VectorXd& some) {
      take(VectorXd(some), b + a * some);
      return result.residual <= 0.1 * contact_solver_tolerance;
    });
  }
  result.push.assign(lambda.begin(), lambda.end());
  result.solved = result.residual <= contact_solver_tolerance;
  return result;
}

} // namespace gewebe
