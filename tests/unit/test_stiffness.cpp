// K, and what follows from it: symmetry, springs' forces, reactions.

#include "fem/model_stiffness.h"
#include "linalg/stiffness.h"

#include "base/digest.h"
#include "larger.h"
#include "stiffness_models.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numeric>

using namespace gewebe;
using namespace gewebe::test;

namespace {

/// Force on each node by the springs at displacement u, as the non-linear model has it.
std::vector<double> spring_forces(const model::Model& model, const std::vector<double>& u) {
  std::vector<double> f(u.size());
  for (const model::Spring& s : model.springs) {
    const auto moved = [&](std::size_t i) {
      return model.nodes[i].position + Vec3{u[3 * i], u[3 * i + 1], u[3 * i + 2]};
    };
    const Vec3 d = moved(s.j) - moved(s.i);
    const double l = norm(d);
    for (int a = 0; a < 3; ++a) {
      const double force = s.stiffness * (l - s.rest) * d[a] / l;
      f[3 * std::size_t{s.i} + static_cast<std::size_t>(a)] += force;
      f[3 * std::size_t{s.j} + static_cast<std::size_t>(a)] -= force;
    }
  }
  return f;
}

double largest(const std::vector<double>& x) {
  double max = 0;
  for (const double value : x)
    max = test::larger(max, std::abs(value));
  return max;
}

/// Central differences of the forces against K u; relative to ‖K u‖.
double difference_error(const model::Model& model) {
  const std::vector<double> u = random_vector(3 * model.nodes.size(), 5);
  const double h = 1e-5;
  std::vector<double> plus = u, minus = u, ku(u.size());
  for (std::size_t i = 0; i < u.size(); ++i) {
    plus[i] *= h;
    minus[i] *= -h;
  }
  fem::multiply_stiffness(model, u, ku);
  const std::vector<double> fp = spring_forces(model, plus), fm = spring_forces(model, minus);
  double error = 0;
  for (std::size_t i = 0; i < u.size(); ++i)
    error = test::larger(error, std::abs(-(fp[i] - fm[i]) / (2 * h) - ku[i]));
  return error / largest(ku);
}

} // namespace

TEST(Stiffness, EqualsDifferencesOfTheForces) {
  model::BuildOptions bend;
  bend.bend = true;
  const model::Model model = model_of(ball(2), 4, bend);
  EXPECT_LE(difference_error(model), 1e-8);
  EXPECT_LE(difference_error(stretched(model, 1.2)), 1e-8);
  EXPECT_LE(difference_error(stretched(model, 0.9)), 1e-8);
  // The check can fail: K of other rest lengths is another matrix.
  const model::Model other = stretched(model, 1.2);
  std::vector<double> a(3 * model.nodes.size()), b(a.size());
  fem::multiply_stiffness(model, random_vector(a.size(), 5), a);
  fem::multiply_stiffness(other, random_vector(a.size(), 5), b);
  double apart = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    apart = test::larger(apart, std::abs(a[i] - b[i]));
  EXPECT_GE(apart, 1e-3 * largest(a));
}

TEST(Stiffness, MatrixAgreesWithSprings) {
  model::Model model = stretched(model_of(ball(2)), 1.1);
  model.nodes[3].fixed = model::fixed_x;
  model.nodes[5].fixed = model::fixed_y | model::fixed_z;
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  ASSERT_EQ(k.column_start.size(), k.order() + 1);
  ASSERT_EQ(k.order(), 3 * (model.nodes.size() - 4) - 3);
  for (std::size_t c = 0; c < k.order(); ++c) {
    const auto begin = static_cast<std::size_t>(k.column_start[c]);
    ASSERT_EQ(k.row[begin], static_cast<std::int64_t>(c)); // the diagonal first
    for (std::size_t at = begin + 1; at < static_cast<std::size_t>(k.column_start[c + 1]); ++at)
      ASSERT_LT(k.row[at - 1], k.row[at]);
    ASSERT_EQ(k.row_of_axis[static_cast<std::size_t>(k.axis_of_row[c])],
              static_cast<std::int64_t>(c));
  }
  const std::vector<double> x = random_vector(k.order(), 1);
  std::vector<double> y(k.order()), u(3 * model.nodes.size()), f(u.size());
  linalg::multiply(k, x, y);
  for (std::size_t r = 0; r < k.order(); ++r)
    u[static_cast<std::size_t>(k.axis_of_row[r])] = x[r];
  fem::multiply_stiffness(model, u, f);
  for (std::size_t r = 0; r < k.order(); ++r)
    EXPECT_NEAR(y[r], f[static_cast<std::size_t>(k.axis_of_row[r])],
                1e-12 * linalg::stiffness_norm(k));
}

TEST(Stiffness, IsSymmetricAndNoMotionCostsLessThanNothing) {
  const model::Model model = model_of(ball(2));
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  const std::vector<double> a = random_vector(k.order(), 2), b = random_vector(k.order(), 3);
  std::vector<double> ka(k.order()), kb(k.order());
  linalg::multiply(k, a, ka);
  linalg::multiply(k, b, kb);
  const auto dot_of = [](const auto& x, const auto& y) {
    return std::inner_product(x.begin(), x.end(), y.begin(), 0.0);
  };
  EXPECT_NEAR(dot_of(a, kb), dot_of(b, ka), 1e-11 * linalg::stiffness_norm(k));
  EXPECT_GT(dot_of(a, ka), 0);
}

TEST(Stiffness, ForcesOfASolutionAndReactionsCancel) {
  const model::Model model = model_of(ball(2));
  const std::vector<double> u = random_vector(3 * model.nodes.size(), 4);
  std::vector<double> f(u.size());
  fem::multiply_stiffness(model, u, f);
  const double scale = largest(f);
  Vec3 sum, turn;
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const Vec3 force{f[3 * i], f[3 * i + 1], f[3 * i + 2]};
    sum += force;
    turn += cross(model.nodes[i].position, force);
  }
  EXPECT_LE(norm(sum), 1e-12 * scale);
  EXPECT_LE(norm(turn), 1e-12 * scale); // at rest length no torque either
}

TEST(Stiffness, OneSpringByHand) {
  model::Model model;
  model.name = "bar";
  model.materials.push_back({});
  model.nodes.resize(2);
  model.nodes[0].fixed = model::fixed_all;
  model.nodes[1].position = {3, 4, 0};
  model.springs.push_back({0, 1, model::SpringKind::edge, 10, 0, 4}); // length 5, rest 4
  const linalg::StiffnessMatrix k = fem::stiffness_matrix(model);
  // n = (0.6, 0.8, 0), 1 - l0/l = 0.2: 10 (nnᵀ + 0.2 (I - nnᵀ))
  const std::vector<double> expected{
      10 * (0.36 + 0.2 * 0.64), 10 * 0.8 * 0.48, 0, 10 * (0.64 + 0.2 * 0.36), 0, 10 * 0.2};
  ASSERT_EQ(k.value.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_NEAR(k.value[i], expected[i], 1e-14);
  EXPECT_NEAR(linalg::stiffness_norm(k), 10.96, 1e-12);
}

TEST(Stiffness, FurtherAxesCanBeLeftOut) {
  const model::Model model = model_of(ball(1));
  std::vector<std::uint8_t> fixed(3 * model.nodes.size());
  fixed[4] = fixed[7] = 1;
  const linalg::StiffnessMatrix all = fem::stiffness_matrix(model),
                                some = fem::stiffness_matrix(model, fixed);
  EXPECT_EQ(some.order() + 2, all.order());
  EXPECT_EQ(some.row_of_axis[4], -1);
  EXPECT_EQ(some.row_of_axis[5], 4);
}

TEST(Stiffness, RefusesWhatCannotMoveOrIsNoNumber) {
  model::Model model = model_of(ball(1));
  model::Model held = model;
  for (model::Node& n : held.nodes)
    n.fixed = model::fixed_all;
  EXPECT_THROW(fem::stiffness_matrix(held), Error);
  for (model::Spring& s : model.springs)
    s.stiffness = 1.7e308;
  EXPECT_THROW(fem::stiffness_matrix(model), Error);
}
