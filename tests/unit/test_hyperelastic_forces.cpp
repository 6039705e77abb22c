// Forces of hyperelastic elements side by side: those of each element by itself, on each processor
// level the same bytes.

#include "base/cpu.h"
#include "fem/hyperelastic.h"
#include "fem/hyperelastic_kernel_internal.h"
#include "fem/hyperelastic_points_internal.h"
#include "larger.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <random>
#include <span>
#include <vector>

namespace gewebe::test {
namespace {

struct Elements {
  std::vector<fem::SolidElement> of;
  std::vector<std::array<Vec3, 10>> u;
  std::vector<Vec3> bubbles;
  std::vector<std::array<double, 4>> own;
};

/// Elements of several shapes and materials, strained by tens of percent; the last ones inside out.
Elements random_elements(const model::HyperelasticLaw& law) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> by(-1, 1);
  Elements all;
  for (std::size_t t = 0; t < 4; ++t) {
    const auto vector = [&](double size) {
      return Vec3{by(random), by(random), by(random)} * size;
    };
    const std::array<Vec3, 4> corners{{vector(0.2), Vec3{2, 0, 0} + vector(0.3),
                                       Vec3{0, 1.5, 0} + vector(0.3),
                                       Vec3{0, 0, 1.2} + vector(0.3)}};
    all.of.push_back(fem::solid_element(
        corners, fem::elasticity(1e3 + 500 * by(random), 0.3 + 0.045 * static_cast<double>(t))));
    all.of.back().law = law;
    std::array<Vec3, 10> u;
    for (Vec3& one : u)
      one = vector(t < 3 ? 0.3 : 1.5);
    all.u.push_back(u);
    all.bubbles.push_back(vector(0.1));
    all.own.push_back({1e3 * by(random), 1e3 * by(random), 1e3 * by(random), 1e3 * by(random)});
  }
  return all;
}

void expect_forces_of_each(const Elements& e, std::size_t count, bool own) {
  std::vector<fem::HyperelasticForces> forces(count);
  std::vector<Vec3> bubbles(e.bubbles.begin(), e.bubbles.begin() + static_cast<long>(count));
  fem::hyperelastic_forces(
      std::span(e.of).first(count), 10, e.u, bubbles,
      own ? std::span(e.own).first(count) : std::span<const std::array<double, 4>>{}, forces);
  for (std::size_t t = 0; t < count; ++t) {
    fem::HyperelasticResponse expected;
    const Vec3 bubble = own ? e.bubbles[t] : fem::settled_bubble(e.of[t], e.u[t], e.bubbles[t]);
    fem::hyperelastic_response(e.of[t], e.u[t], bubble, fem::HyperelasticPart::force, expected,
                               own ? &e.own[t] : nullptr);
    EXPECT_LE(norm(bubbles[t] - bubble), 1e-9 * (1 + norm(bubble)));
    EXPECT_LE(std::abs(forces[t].energy - expected.energy), 1e-11 * std::abs(expected.energy));
    double most = 0, off = 0;
    for (std::size_t a = 0; a < fem::HyperelasticResponse::nodes; ++a) {
      most = test::larger(most, norm(expected.force[a]));
      off = test::larger(off, norm(forces[t].force[a] - expected.force[a]));
    }
    EXPECT_GT(most, 1);
    EXPECT_LE(off, 1e-9 * most);
    for (std::size_t p = 0; p < 4; ++p)
      EXPECT_LE(std::abs(forces[t].pressure[p] - expected.pressure[p]),
                1e-9 * (1 + std::abs(expected.pressure[p])));
  }
}

TEST(HyperelasticForces, AreThoseOfEachElement) {
  model::HyperelasticLaw yeoh;
  yeoh.kind = model::HyperelasticLaw::yeoh;
  yeoh.parameter = {0.1, 0, 0};
  for (const model::HyperelasticLaw& law : {model::HyperelasticLaw{}, yeoh})
    for (const bool own : {false, true})
      for (const std::size_t count : {std::size_t{1}, std::size_t{3}, std::size_t{4}})
        expect_forces_of_each(random_elements(law), count, own);
}

TEST(HyperelasticForces, AreTheSameOnEachProcessor) {
  if (best_cpu_level() == CpuLevel::baseline)
    GTEST_SKIP() << "one level alone";
  fem::HyperelasticPoints points{};
  const std::vector<fem::IntegrationPoint>& from = fem::quadratic_points();
  for (std::size_t n = 0; n < fem::HyperelasticPoints::count; ++n) {
    points.weight[n] = from[n].weight;
    for (std::size_t k = 0; k < 4; ++k) {
      points.at[n][k] = from[n].at[k];
      points.bubble[n][k] = 0.3 + 0.1 * static_cast<double>(k);
    }
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> by(-1, 1);
  fem::HyperelasticGroup group{};
  for (std::size_t lane = 0; lane < 4; ++lane) {
    group.volume[lane] = 1 + static_cast<double>(lane);
    group.mu[lane] = 100;
    group.lambda[lane] = 500;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 4; ++k)
        group.gradient[k][i][lane] = by(random);
      for (std::size_t a = 0; a < 10; ++a)
        group.u[a][i][lane] = 0.2 * by(random);
    }
  }
  for (const bool own : {false, true}) {
    fem::HyperelasticGroup one = group, other = group;
    fem::HyperelasticGroupResult a{}, b{};
    fem::evaluate_group_baseline(points, own, one, a);
    fem::evaluate_group_avx2(points, own, other, b);
    EXPECT_EQ(std::memcmp(&a, &b, sizeof a), 0);
    EXPECT_EQ(std::memcmp(&one, &other, sizeof one), 0);
  }
}

} // namespace
} // namespace gewebe::test
