#include "collision/ccd.h"

#include "collision/distance.h"
#include "collision_pairs.h"
#include "larger.h"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

namespace gewebe::collision {
namespace {

using test::passes;
using test::random_pair;
using test::random_point;

template <std::size_t n>
std::array<Vec3, n> between(const std::array<Vec3, n>& x0, const std::array<Vec3, n>& x1,
                            double t) {
  std::array<Vec3, n> x;
  for (std::size_t k = 0; k < n; ++k)
    x[k] = x0[k] + t * (x1[k] - x0[k]);
  return x;
}

TEST(CollisionCcd, PointNeverPassesATriangleAtRest) {
  std::mt19937 random(1);
  int stopped = 0, full = 0;
  for (int k = 0; k < 100000; ++k) {
    const auto x0 = random_pair<4>(random);
    auto x1 = x0;
    x1[0] = k % 3 == 0 ? x0[0] + 3 * (0.3 * (x0[1] + x0[2]) + 0.4 * x0[3] - x0[0])
                       : random_pair<4>(random)[0];
    const double t = point_triangle_step(x0, x1, {.share = 0.1});
    ASSERT_TRUE(t >= 0 && t <= 1);
    full += t == 1;
    stopped += t < 1;
    if (t > 0) {
      ASSERT_FALSE(passes(x0[0], between(x0, x1, t)[0], x0[1], x0[2], x0[3])) << k;
    }
  }
  EXPECT_GT(full, 10000);
  EXPECT_GT(stopped, 10000);
}

TEST(CollisionCcd, EdgeNeverPassesAnEdgeAtRest) {
  std::mt19937 random(2);
  int stopped = 0;
  for (int k = 0; k < 100000; ++k) {
    const auto x0 = random_pair<4>(random);
    auto x1 = x0;
    x1[0] = random_pair<4>(random)[0]; // one end moves: the edge sweeps a triangle
    const double t = edge_edge_step(x0, x1, {.share = 0.1});
    stopped += t < 1;
    if (t > 0) {
      ASSERT_FALSE(passes(x0[2], x0[3], x0[0], between(x0, x1, t)[0], x0[1])) << k;
    }
  }
  EXPECT_GT(stopped, 2000);
}

template <std::size_t n, class Step, class Distance>
void expect_kept(unsigned seed, Step&& step, Distance&& squared) {
  std::mt19937 random(seed);
  int stopped = 0, tried = 0, too_short = 0;
  for (int k = 0; k < 1500; ++k) {
    const auto x0 = random_pair<n>(random);
    auto x1 = x0;
    for (Vec3& p : x1)
      p = random_point(random, 3);
    const double d0 = std::sqrt(squared(x0));
    const double d_min = k % 2 == 0 ? 0 : 0.3 * d0;
    const Separation separation{.d_min = d_min, .share = 0.5, .most = k % 3 == 0 ? 0.05 : 1e300};
    const double t = step(x0, x1, separation);
    if (!(d0 > 1e-9)) {
      EXPECT_LE(t, 1);
      continue;
    }
    const double kept = std::fmin(0.5 * (d0 - d_min), separation.most);
    EXPECT_GE(std::sqrt(squared(between(x0, x1, t))) - d_min, kept * (1 - 1e-9) - 1e-8);
    for (int i = 1; i < 100; ++i)
      ASSERT_GT(std::sqrt(squared(between(x0, x1, t * i / 100))), d_min);
    stopped += t < 1;
    // No step is much shorter than it must be: at twice that far a sample comes too near.
    if (t < 0.4 && t > 0) {
      double least = HUGE_VAL;
      for (int i = 0; i <= 1000; ++i)
        least = test::smaller(
            least, std::sqrt(squared(between(x0, x1, t + t * i / 1000 + 0.05 * i / 1000))) - d_min);
      ++tried;
      too_short += !(least < kept * 1.02 + 3e-4);
    }
  }
  EXPECT_GT(stopped, 250);
  EXPECT_GT(tried, 100);
  EXPECT_LE(too_short, 3); // gaps near rounding
}

TEST(CollisionCcd, KeepsTheGapOnTheWayAndAtItsEnd) {
  expect_kept<4>(
      3,
      [](const auto& a, const auto& b, const Separation& s) {
        return point_triangle_step(a, b, s);
      },
      [](const auto& x) { return point_triangle_squared_distance(x); });
  expect_kept<4>(
      4, [](const auto& a, const auto& b, const Separation& s) { return edge_edge_step(a, b, s); },
      [](const auto& x) { return edge_edge_squared_distance(x); });
  expect_kept<3>(
      5, [](const auto& a, const auto& b, const Separation& s) { return point_edge_step(a, b, s); },
      [](const auto& x) { return point_edge_squared_distance(x); });
  expect_kept<2>(
      6,
      [](const auto& a, const auto& b, const Separation& s) { return point_point_step(a, b, s); },
      [](const auto& x) { return dot(x[0] - x[1], x[0] - x[1]); });
}

TEST(CollisionCcd, SlidesAlongAFaceInOneStep) {
  const std::array<Vec3, 4> x0{{{1, 1, 1e-6}, {0, 0, 0}, {9, 0, 0}, {0, 9, 0}}};
  auto x1 = x0;
  x1[0].x = 5;
  EXPECT_EQ(point_triangle_step(x0, x1, {.iterations = 3}), 1);
  x1[0].z = -1; // down: as far as half the gap
  EXPECT_NEAR(point_triangle_step(x0, x1, {}) / 0.5e-6, 1, 1e-5);
}

/// Deep in contact a triangle turns by much more than the gap, about a point that goes along.
TEST(CollisionCcd, FollowsAFaceThatTurnsByFewPlanes) {
  for (const double gap : {1e-4, 1e-6}) {
    const std::array<Vec3, 4> x0{{{3, 3, gap}, {0, 0, 0}, {9, 0, 0}, {0, 9, 0}}};
    auto x1 = x0;
    x1[1].z = -3e-3;
    x1[2].z = 3e-3;
    x1[3].z = 1e-3;
    x1[0] = (x1[1] + x1[2] + x1[3]) / 3 + Vec3{0, 0, gap};
    EXPECT_EQ(point_triangle_step(x0, x1, {.iterations = 8}), 1) << gap;
    x1[0].z -= 0.8 * gap; // the gap may become half of what it was
    const double t = point_triangle_step(x0, x1, {.iterations = 50});
    EXPECT_NEAR(t, 0.5 / 0.8, 0.02) << gap;
  }
}

TEST(CollisionCcd, NoStepWithoutAGapOrWithANaN) {
  std::array<Vec3, 4> x0{{{1, 1, 0}, {0, 0, 0}, {9, 0, 0}, {0, 9, 0}}}, x1 = x0;
  x1[0].z = -1;
  EXPECT_EQ(point_triangle_step(x0, x1, {}), 0);
  x0[0].z = 0.5;
  EXPECT_EQ(point_triangle_step(x0, x1, {.d_min = 0.5}), 0);
  EXPECT_GT(point_triangle_step(x0, x1, {.d_min = 0.4}), 0);
  EXPECT_EQ(point_triangle_step(x0, x0, {}), 1);
  x1[0].y = std::nan("");
  EXPECT_EQ(point_triangle_step(x0, x1, {}), 0);
}

TEST(CollisionCcd, MotionBoundLeavesOutTheMean) {
  const std::array<Vec3, 3> x0{{{0, 0, 1}, {0, 0, 0}, {1, 0, 0}}};
  const Vec3 way{5, 6, 7};
  EXPECT_NEAR(motion_bound(x0, std::array{x0[0] + way, x0[1] + way, x0[2] + way}, 1), 0, 1e-14);
  EXPECT_NEAR(motion_bound(x0, std::array{x0[0] + Vec3{0, 0, 3}, x0[1], x0[2]}, 1), 3, 1e-14);
}

} // namespace
} // namespace gewebe::collision
