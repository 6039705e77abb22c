#include "contact/barrier.h"

#include "collision/candidates.h"
#include "collision_pairs.h"
#include "collision_scene.h"
#include "contact/contact_pairs.h"
#include "larger.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <vector>

namespace gewebe::contact {
namespace {

using collision::AllowedPairs;
using collision::BroadPhase;
using collision::Candidates;
using collision::CollisionSurface;

/// As in the paper: triangles overlap.
ContactPairs pairs_of(CollisionSurface surface, const std::vector<Vec3>& x, double d_hat,
                      bool self = false) {
  surface.overlap.clear();
  AllowedPairs allowed(4, 1);
  for (std::size_t k = 0; k < 4; ++k)
    allowed.set(k, k, self ? 1 : 0);
  Candidates candidates;
  BroadPhase(surface).find(surface, x, x, d_hat, allowed, candidates);
  ContactPairs pairs;
  find_active_pairs(surface, candidates, x, d_hat, pairs);
  return pairs;
}

TEST(Barrier, DerivativesOfTheFunction) {
  for (const double d_min : {0.0, 0.7}) {
    const double range = barrier_range(0.1, d_min);
    EXPECT_NEAR(range, (d_min + 0.1) * (d_min + 0.1) - d_min * d_min, 1e-15);
    for (const double share : {0.01, 0.2, 0.5, 0.9, 0.999}) {
      const double s = share * range, h = 1e-5 * s;
      const BarrierValue b = barrier(s, range), up = barrier(s + h, range),
                         down = barrier(s - h, range);
      EXPECT_NEAR(b.value, -(s - range) * (s - range) * std::log(s / range), 1e-14);
      EXPECT_GT(b.value, 0);
      EXPECT_LT(b.first, 0);
      EXPECT_GT(b.second, 0);
      EXPECT_NEAR(b.first, (up.value - down.value) / (2 * h), 1e-6 * range);
      EXPECT_NEAR(b.second, (up.first - down.first) / (2 * h), 1e-5 * b.second + 1e-8);
    }
    EXPECT_EQ(barrier(range, range).value, 0);
    EXPECT_EQ(barrier(2 * range, range).first, 0);
    EXPECT_EQ(barrier(0, range).value, std::numeric_limits<double>::infinity());
    EXPECT_EQ(barrier(std::nan(""), range).value, std::numeric_limits<double>::infinity());
  }
}

TEST(Barrier, GradientAndHessianAreThoseOfDifferences) {
  const double d_hat = 0.2, kappa = 3;
  int mollified = 0, kinds[5] = {};
  for (unsigned seed = 1; seed < 4; ++seed) {
    const CollisionSurface surface = test::two_sheets(4, 0.1, seed == 3 ? 0 : 0.03, 0.5, seed);
    std::vector<Vec3> x = surface.rest;
    ContactPairs pairs = pairs_of(surface, x, d_hat);
    ASSERT_GT(pairs.pairs.size(), 30U);
    for (const ContactPair& pair : pairs.pairs) {
      mollified += pair.eps_x > 0;
      ++kinds[pair.count];
      // One pair at a time, its set kept.
      ContactPairs one{{pair}, d_hat};
      std::vector<HessianBlock> exact, projected, gauss;
      barrier_hessian(one, x, kappa, HessianMode::exact, exact);
      barrier_hessian(one, x, kappa, HessianMode::projected, projected);
      barrier_hessian(one, x, kappa, HessianMode::gauss_newton, gauss);
      std::vector<Vec3> g(x.size()), up(x.size()), down(x.size());
      const double energy = add_barrier_gradient(one, x, kappa, g);
      EXPECT_EQ(energy, barrier_energy(one, x, kappa));
      Vec3 sum;
      double size = 0;
      for (const Vec3& v : g) {
        sum += v;
        size = test::larger(size, norm(v));
      }
      EXPECT_LE(norm(sum), 1e-14 * size);
      const std::size_t n = 3 * std::size_t{pair.count};
      const double h = 1e-6;
      double scale = 0;
      for (std::size_t k = 0; k < n * n; ++k)
        scale = test::larger(scale, std::abs(exact[0].entry[k]));
      for (std::size_t i = 0; i < n; ++i) {
        double& at = x[pair.vertex[i / 3]][static_cast<int>(i % 3)];
        const double old = at;
        std::fill(up.begin(), up.end(), Vec3{});
        std::fill(down.begin(), down.end(), Vec3{});
        at = old + h;
        const double above = add_barrier_gradient(one, x, kappa, up);
        at = old - h;
        const double below = add_barrier_gradient(one, x, kappa, down);
        at = old;
        EXPECT_NEAR(g[pair.vertex[i / 3]][static_cast<int>(i % 3)], (above - below) / (2 * h),
                    1e-5 * size + 1e-9);
        for (std::size_t j = 0; j < n; ++j) {
          const int axis = static_cast<int>(j % 3);
          EXPECT_NEAR(exact[0].entry[i * n + j],
                      (up[pair.vertex[j / 3]][axis] - down[pair.vertex[j / 3]][axis]) / (2 * h),
                      1e-4 * scale + 1e-7);
        }
      }
      // The projected one is no less than the exact one and than 0 along random directions.
      std::mt19937 random(seed);
      for (int k = 0; k < 10; ++k) {
        std::array<double, 12> v{};
        for (double& c : v)
          c = test::random_point(random, 1).x;
        double of_exact = 0, of_projected = 0, of_gauss = 0;
        for (std::size_t i = 0; i < n; ++i)
          for (std::size_t j = 0; j < n; ++j) {
            of_exact += v[i] * exact[0].entry[i * n + j] * v[j];
            of_projected += v[i] * projected[0].entry[i * n + j] * v[j];
            of_gauss += v[i] * gauss[0].entry[i * n + j] * v[j];
          }
        EXPECT_GE(of_projected, -1e-9 * scale);
        EXPECT_GE(of_projected, of_exact - 1e-9 * scale);
        EXPECT_GE(of_gauss, -1e-9 * scale);
      }
    }
  }
  EXPECT_GT(mollified, 20);
  for (const int count : {2, 3, 4})
    EXPECT_GT(kinds[count], 5);
}

/// A case of round numbers, with pairs of all kinds, and what ipc-toolkit 1.6.1 (ipctk) has for it;
/// tests/validate/collision.cpp compares many more.
TEST(Barrier, EnergyIsThatOfIpcToolkit) {
  CollisionSurface surface = test::two_sheets(3, 0.14, 0, 0.02, 0);
  surface.radius.assign(surface.size(), 0.02);
  std::vector<Vec3> x = surface.rest;
  for (std::size_t k = 0; k < x.size(); ++k)
    x[k] += 0.005 * Vec3{static_cast<double>(k * 7 % 11), static_cast<double>(k * 5 % 13),
                         static_cast<double>(k * 3 % 7)};
  const ContactPairs pairs = pairs_of(surface, x, 0.2);
  std::vector<Vec3> gradient(x.size());
  const double energy = add_barrier_gradient(pairs, x, 3, gradient);
  int mollified = 0;
  for (const ContactPair& pair : pairs.pairs)
    mollified += pair.eps_x > 0;
  EXPECT_EQ(pairs.pairs.size(), 63U);
  EXPECT_EQ(mollified, 2);
  EXPECT_NEAR(energy, 0.3441118566738675, 1e-12);
  EXPECT_NEAR(gradient[4].x, -0.00640291593037821, 1e-12);
  EXPECT_NEAR(gradient[4].y, 0.2694199217124332, 1e-12);
  EXPECT_NEAR(gradient[4].z, 2.3757185059069226, 1e-12);
  EXPECT_NEAR(smallest_gap(pairs, x), 0.08391697799029041 - 0.04, 1e-14);
}

TEST(Barrier, ProjectionOfASemidefiniteHessianIsTheSame) {
  const CollisionSurface surface = test::two_sheets(4, 0.1, 0.03, 0.5, 5);
  const ContactPairs pairs = pairs_of(surface, surface.rest, 0.2);
  std::vector<HessianBlock> once;
  barrier_hessian(pairs, surface.rest, 1, HessianMode::projected, once);
  // Rank one: distance of two points along their line.
  ContactPairs one;
  one.d_hat = 0.2;
  std::copy_if(pairs.pairs.begin(), pairs.pairs.end(), std::back_inserter(one.pairs),
               [](const ContactPair& p) { return p.count == 2; });
  ASSERT_FALSE(one.pairs.empty());
  std::vector<HessianBlock> exact, projected;
  barrier_hessian(one, surface.rest, 1, HessianMode::exact, exact);
  barrier_hessian(one, surface.rest, 1, HessianMode::projected, projected);
  for (std::size_t k = 0; k < exact.size(); ++k) {
    // u^T H u along the line is kept, across it the negative value becomes 0.
    const Vec3 d = surface.rest[one.pairs[k].vertex[0]] - surface.rest[one.pairs[k].vertex[1]];
    const Vec3 along = d / norm(d);
    double before = 0, after = 0, trace = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      trace += projected[k].entry[i * 6 + i];
      for (std::size_t j = 0; j < 3; ++j) {
        before +=
            along[static_cast<int>(i)] * exact[k].entry[i * 6 + j] * along[static_cast<int>(j)];
        after +=
            along[static_cast<int>(i)] * projected[k].entry[i * 6 + j] * along[static_cast<int>(j)];
      }
    }
    EXPECT_NEAR(before, after, 1e-9 * std::abs(before));
    EXPECT_NEAR(trace, after, 1e-9 * std::abs(before));
  }
}

TEST(Barrier, ForcesSumToZeroAndNeverPull) {
  const CollisionSurface surface = test::two_sheets(6, 0.1, 0.03, 0.5, 7);
  const ContactPairs pairs = pairs_of(surface, surface.rest, 0.2);
  std::vector<std::array<Vec3, 4>> forces;
  barrier_forces(pairs, surface.rest, 2, forces);
  std::vector<Vec3> gradient(surface.size());
  add_barrier_gradient(pairs, surface.rest, 2, gradient);
  for (std::size_t k = 0; k < forces.size(); ++k) {
    const ContactPair& pair = pairs.pairs[k];
    Vec3 sum;
    for (std::size_t i = 0; i < pair.count; ++i) {
      sum += forces[k][i];
      gradient[pair.vertex[i]] += forces[k][i];
    }
    EXPECT_LE(norm(sum), 1e-13 * (1e-6 + norm(forces[k][0])));
    if (pair.eps_x > 0)
      continue;
    std::array<Vec3, 4> copy;
    const auto closest =
        collision::closest_points(pair.feature, positions_of(pair, surface.rest, copy));
    double along = 0;
    for (std::size_t i = 0; i < pair.count; ++i)
      along += closest.weight[i] * dot(forces[k][i], closest.difference);
    EXPECT_GE(along, 0);
  }
  for (const Vec3& rest : gradient)
    EXPECT_LT(norm(rest), 1e-12);
}

TEST(Barrier, InfiniteAtContact) {
  CollisionSurface surface;
  surface.rest = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 1, 0.5}};
  surface.owner = {0, 0, 0, 1};
  surface.radius = {0, 0, 0, 0.5};
  surface.triangles = {{0, 1, 2}};
  surface.points = {3};
  complete_surface(surface);
  AllowedPairs allowed(2, 1);
  Candidates candidates;
  BroadPhase(surface).find(surface, surface.rest, surface.rest, 0.1, allowed, candidates);
  ContactPairs pairs;
  find_active_pairs(surface, candidates, surface.rest, 0.1, pairs);
  ASSERT_EQ(pairs.pairs.size(), 1U);
  EXPECT_EQ(pairs.pairs[0].d_min, 0.5);
  EXPECT_EQ(barrier_energy(pairs, surface.rest, 1), std::numeric_limits<double>::infinity());
  EXPECT_EQ(smallest_gap(pairs, surface.rest), 0);
  surface.rest[3].z = 0.55;
  EXPECT_NEAR(smallest_gap(pairs, surface.rest), 0.05, 1e-15);
  EXPECT_NEAR(barrier_energy(pairs, surface.rest, 1),
              barrier(0.55 * 0.55 - 0.25, barrier_range(0.1, 0.5)).value, 1e-16);
}

} // namespace
} // namespace gewebe::contact
