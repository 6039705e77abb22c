#include "contact/friction.h"

#include "collision/candidates.h"
#include "collision_pairs.h"
#include "collision_scene.h"
#include "larger.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace gewebe::contact {
namespace {

struct Lagged {
  collision::CollisionSurface surface;
  ContactPairs contact;
  std::vector<FrictionPair> pairs;
};

Lagged lagged(double mu, unsigned seed) {
  Lagged all;
  all.surface = test::two_sheets(5, 0.1, 0.03, 0.5, seed);
  collision::AllowedPairs allowed(4, 1);
  for (std::size_t k = 0; k < 4; ++k)
    allowed.set(k, k, 0);
  const std::vector<Vec3>& x = all.surface.rest;
  collision::Candidates candidates;
  collision::BroadPhase(all.surface).find(all.surface, x, x, 0.2, allowed, candidates);
  find_active_pairs(all.surface, candidates, x, 0.2, all.contact);
  lag_friction(all.surface, all.contact, x, 2, FrictionTable(4, mu), all.pairs);
  return all;
}

std::vector<Vec3> displaced(const std::vector<Vec3>& x, double by, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Vec3> y = x;
  for (Vec3& p : y)
    p += test::random_point(random, by);
  return y;
}

/// v^T H v of a random v.
double random_form(const HessianBlock& block, std::mt19937& random) {
  const std::size_t n = 3 * std::size_t{block.count};
  std::array<double, 12> v{};
  for (double& c : v)
    c = test::random_point(random, 1).x;
  double form = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      form += v[i] * block.entry[i * n + j] * v[j];
  return form;
}

TEST(Friction, SmoothFunctionAndItsDerivatives) {
  const double e = 0.3, h = 1e-6;
  const auto first = [&](double u) { return smooth_friction(u, e).first_over_u * u; };
  for (const double u : {1e-4, 0.05, 0.15, 0.29, 0.31, 2.0}) {
    const FrictionValue f = smooth_friction(u, e);
    EXPECT_NEAR(first(u), u < e ? 2 * u / e - u / e * u / e : 1, 1e-14);
    EXPECT_NEAR((smooth_friction(u + h, e).value - smooth_friction(u - h, e).value) / (2 * h),
                first(u), 1e-8);
    const double second = (first(u + h) - first(u - h)) / (2 * h);
    EXPECT_NEAR(f.second * u * u, second - f.first_over_u, 1e-7);
  }
  EXPECT_EQ(smooth_friction(e, e).value, e);
  EXPECT_DOUBLE_EQ(smooth_friction(0, e).value, e / 3);
  EXPECT_DOUBLE_EQ(smooth_friction(std::nextafter(e, 0), e).value, e);
}

TEST(Friction, GradientAndHessianAreThoseOfDifferences) {
  for (const double by : {0.001, 0.02, 0.5}) {
    const Lagged all = lagged(0.7, 1);
    ASSERT_GT(all.pairs.size(), 30U);
    const std::vector<Vec3>& start = all.surface.rest;
    std::vector<Vec3> x = displaced(start, by, 2);
    for (const FrictionPair& pair : all.pairs) {
      const std::span<const FrictionPair> one(&pair, 1);
      const double e = 0.02, h = 1e-6 * by;
      std::vector<Vec3> g(x.size()), up(x.size()), down(x.size());
      EXPECT_EQ(add_friction_gradient(one, x, start, e, g), friction_energy(one, x, start, e));
      std::vector<HessianBlock> blocks;
      friction_hessian(one, x, start, e, HessianMode::exact, blocks);
      const std::size_t n = 3 * std::size_t{pair.count};
      double scale = 0;
      for (std::size_t k = 0; k < n * n; ++k)
        scale = test::larger(scale, std::abs(blocks[0].entry[k]));
      for (std::size_t i = 0; i < n; ++i) {
        double& at = x[pair.vertex[i / 3]][static_cast<int>(i % 3)];
        const double old = at;
        std::fill(up.begin(), up.end(), Vec3{});
        std::fill(down.begin(), down.end(), Vec3{});
        at = old + h;
        const double above = add_friction_gradient(one, x, start, e, up);
        at = old - h;
        const double below = add_friction_gradient(one, x, start, e, down);
        at = old;
        EXPECT_NEAR(g[pair.vertex[i / 3]][static_cast<int>(i % 3)], (above - below) / (2 * h),
                    1e-6 * pair.limit);
        for (std::size_t j = 0; j < n; ++j) {
          const int axis = static_cast<int>(j % 3);
          EXPECT_NEAR(blocks[0].entry[i * n + j],
                      (up[pair.vertex[j / 3]][axis] - down[pair.vertex[j / 3]][axis]) / (2 * h),
                      2e-5 * scale);
        }
      }
      std::mt19937 random(3);
      for (int k = 0; k < 5; ++k) {
        EXPECT_GE(random_form(blocks[0], random), -1e-12 * scale);
      }
    }
  }
}

TEST(Friction, PrimalDualHessianIsPositiveAndBecomesTheExactOne) {
  std::mt19937 random(4);
  for (const double by : {0.001, 0.02, 0.5}) {
    Lagged all = lagged(0.7, 1);
    const std::vector<Vec3>& start = all.surface.rest;
    const std::vector<Vec3> x = displaced(start, by, 2);
    const double e = 0.02;
    for (FrictionPair& pair : all.pairs) {
      const std::span<FrictionPair> one(&pair, 1);
      const std::size_t n = 3 * std::size_t{pair.count};
      std::vector<HessianBlock> blocks, exact;
      friction_hessian(one, x, start, e, HessianMode::exact, exact);
      double scale = 0;
      for (std::size_t k = 0; k < n * n; ++k)
        scale = test::larger(scale, std::abs(exact[0].entry[k]));
      for (int k = 0; k < 20; ++k) {
        Vec3 dual = test::random_point(random, 1);
        dual = dual - dot(dual, pair.normal) * pair.normal;
        pair.dual = dual / std::max(1.0, norm(dual));
        friction_hessian(one, x, start, e, HessianMode::gauss_newton, blocks);
        EXPECT_GE(random_form(blocks[0], random), -1e-12 * scale);
      }
      advance_duals(one, x, x, start, e, 1); // a step that moves nothing: the force itself
      friction_hessian(one, x, start, e, HessianMode::gauss_newton, blocks);
      for (std::size_t k = 0; k < n * n; ++k)
        EXPECT_NEAR(blocks[0].entry[k], exact[0].entry[k], 1e-12 * scale);
    }
  }
}

/// A point on a rough plane is drawn by a spring whose end is far away, now here, now there. Whole
/// steps of the primal-dual method end where force and friction balance, in few iterations.
TEST(Friction, PrimalDualStepsFindTheBalanceFromAfar) {
  const double e = 1e-3, limit = 2, spring = 5;
  FrictionPair pair;
  pair.count = 2;
  pair.vertex = {0, 1, 0, 0};
  pair.weight = {1, -1, 0, 0};
  pair.tangent = {Vec3{1, 0, 0}, Vec3{0, 1, 0}};
  pair.normal = {0, 0, 1};
  pair.limit = limit;
  const std::vector<Vec3> start(2);
  std::vector<Vec3> x(2);
  for (int n = 0; n < 12; ++n) {
    const Vec3 end{2 * std::cos(2.4 * n), 2 * std::sin(2.4 * n), 0};
    int k = 0;
    for (; k < 200; ++k) {
      std::vector<Vec3> gradient(2);
      (void)add_friction_gradient({&pair, 1}, x, start, e, gradient);
      const Vec3 g = gradient[0] + spring * (x[0] - end);
      if (norm(g) <= 1e-9 * limit)
        break;
      std::vector<HessianBlock> blocks;
      friction_hessian({&pair, 1}, x, start, e, HessianMode::gauss_newton, blocks);
      const double a = blocks[0].entry[0] + spring, b = blocks[0].entry[1],
                   c = blocks[0].entry[7] + spring, det = a * c - b * b;
      std::vector<Vec3> to = x;
      to[0] += Vec3{-(c * g.x - b * g.y) / det, -(a * g.y - b * g.x) / det, 0};
      advance_duals({&pair, 1}, x, to, start, e, 1);
      x = to;
    }
    EXPECT_LE(k, 15) << n;
    EXPECT_NEAR(norm(x[0]), 2 - limit / spring, 1e-8) << n;
  }
}

TEST(Friction, ForcesSumToZeroOpposeTheSlipAndKeepTheCone) {
  const Lagged all = lagged(0.4, 5);
  const std::vector<Vec3>& start = all.surface.rest;
  const std::vector<Vec3> x = displaced(start, 0.1, 6);
  std::vector<std::array<Vec3, 4>> forces;
  friction_forces(all.pairs, x, start, 0.02, forces);
  for (std::size_t k = 0; k < forces.size(); ++k) {
    const FrictionPair& pair = all.pairs[k];
    Vec3 sum, first, relative;
    for (std::size_t i = 0; i < pair.count; ++i) {
      sum += forces[k][i];
      if (pair.weight[i] > 0)
        first += forces[k][i];
      relative += pair.weight[i] * (x[pair.vertex[i]] - start[pair.vertex[i]]);
    }
    EXPECT_LE(norm(sum), 1e-14 * pair.limit);
    EXPECT_LE(norm(first), pair.limit * (1 + 1e-12));
    EXPECT_LE(dot(first, relative), 0);
    EXPECT_NEAR(dot(first, pair.normal), 0, 1e-12 * pair.limit);
    EXPECT_NEAR(pair.limit, 0.4 * pair.normal_force, 1e-14 * pair.limit);
  }
}

TEST(Friction, NormalForceIsTheBarriers) {
  const Lagged all = lagged(1, 7);
  std::vector<std::array<Vec3, 4>> forces;
  barrier_forces(all.contact, all.surface.rest, 2, forces);
  std::size_t at = 0;
  for (const FrictionPair& pair : all.pairs) {
    while (all.contact.pairs[at].vertex != pair.vertex || all.contact.pairs[at].eps_x > 0)
      ++at;
    for (std::size_t i = 0; i < pair.count; ++i)
      EXPECT_LE(norm(forces[at][i] - pair.normal_force * pair.weight[i] * pair.normal),
                1e-12 * pair.normal_force);
  }
}

/// Two equal flat sheets, one moved by `aside` along x and by `gap` along z.
collision::CollisionSurface flat_sheets(double gap, double aside) {
  collision::CollisionSurface surface = test::two_sheets(4, 0, 0, 0.1, 1);
  surface.points.clear();
  surface.edges.clear();
  surface.rest.resize(32);
  surface.owner.resize(32);
  surface.radius.resize(32);
  for (std::size_t k = 0; k < 16; ++k)
    surface.rest[16 + k] = surface.rest[k] + Vec3{aside, 0, gap};
  complete_surface(surface);
  return surface;
}

TEST(Friction, AnApproachOfFlatSurfacesSlipsNowhere) {
  for (const double aside : {0.0, 0.003, 0.007}) {
    Lagged all;
    all.surface = flat_sheets(0.005, aside);
    collision::AllowedPairs allowed(2, 0);
    allowed.set(0, 1, 1);
    const std::vector<Vec3>& x = all.surface.rest;
    collision::Candidates candidates;
    collision::BroadPhase(all.surface).find(all.surface, x, x, 0.01, allowed, candidates);
    find_active_pairs(all.surface, candidates, x, 0.01, all.contact);
    lag_friction(all.surface, all.contact, x, 2, FrictionTable(2, 0.5), all.pairs);
    std::vector<Vec3> start = x;
    for (std::size_t k = 16; k < 32; ++k)
      start[k].z += 0.4;
    align_friction(all.surface, x, start, 0.1, all.pairs);
    ASSERT_GE(all.pairs.size(), 16U);
    std::vector<Vec3> gradient(x.size());
    std::vector<double> normal_force(x.size());
    (void)add_friction_gradient(all.pairs, x, start, 1e-5, gradient);
    for (const FrictionPair& pair : all.pairs) {
      EXPECT_NEAR(pair.added_stick, 0.04, 1e-4);
      for (std::size_t k = 0; k < pair.count; ++k)
        normal_force[pair.vertex[k]] += std::abs(pair.weight[k]) * pair.normal_force;
    }
    for (const std::uint32_t inner : {5U, 6U, 9U, 10U, 21U, 22U, 25U, 26U}) {
      EXPECT_GT(normal_force[inner], 0);
      EXPECT_LT(norm(gradient[inner]), 0.05 * 0.5 * normal_force[inner]);
    }
  }
}

TEST(Friction, SharpEdgesAndInstrumentsKeepTheDirectionOfTheirDistance) {
  // Roofs with ridges along x and, turned over, along y.
  collision::CollisionSurface surface;
  surface.rest = {{-1, 0, 0},   {1, 0, 0}, {0, 1, -1}, {0, -1, -1},  {0, -1, 0.01},
                  {0, 1, 0.01}, {1, 0, 1}, {-1, 0, 1}, {0.5, 0, 0.2}};
  surface.triangles = {{0, 1, 2}, {1, 0, 3}, {5, 4, 6}, {4, 5, 7}};
  surface.owner = {0, 0, 0, 0, 1, 1, 1, 1, 2};
  surface.radius.assign(9, 0);
  surface.radius[8] = 0.19;
  surface.points = {8};
  complete_surface(surface);
  collision::AllowedPairs allowed(3, 1);
  const std::vector<Vec3>& x = surface.rest;
  collision::Candidates candidates;
  collision::BroadPhase(surface).find(surface, x, x, 0.03, allowed, candidates);
  ContactPairs contact;
  find_active_pairs(surface, candidates, x, 0.03, contact);
  std::vector<FrictionPair> pairs, smoothed;
  lag_friction(surface, contact, x, 2, FrictionTable(3, 0.5), pairs);
  ASSERT_GE(pairs.size(), 2U);
  smoothed = pairs;
  align_friction(surface, x, x, 0.1, smoothed);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    EXPECT_LT(norm(smoothed[k].normal - pairs[k].normal), 1e-6);
    EXPECT_EQ(smoothed[k].added_stick, 0);
  }
}

TEST(Friction, NoneWithoutACoefficient) {
  EXPECT_TRUE(lagged(0, 1).pairs.empty());
}

} // namespace
} // namespace gewebe::contact
