#include "contact/contact_pairs.h"

#include "collision/candidates.h"
#include "contact/barrier.h"
#include "larger.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace gewebe::contact {
namespace {

using collision::CollisionSurface;

constexpr double d_hat = 0.1;

/// An irregular flat sheet of 5 x 5 nodes in the plane z = height(x, y), and a point above it.
template <class Height>
CollisionSurface sheet_and_point(const Vec3& point, const Height& height) {
  CollisionSurface surface;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> off(-0.3, 0.3);
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 5; ++i) {
      const bool rim = i == 0 || j == 0 || i == 4 || j == 4;
      const double x = i + (rim ? 0 : off(random)), y = j + (rim ? 0 : off(random));
      surface.rest.push_back({x, y, height(x, y)});
    }
  for (std::uint32_t j = 0; j < 4; ++j)
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t a = 5 * j + i;
      surface.triangles.push_back({a, a + 1, a + 5});
      surface.triangles.push_back({a + 1, a + 6, a + 5});
    }
  surface.owner.assign(25, 0);
  surface.rest.push_back(point);
  surface.owner.push_back(1);
  surface.points = {25};
  complete_surface(surface);
  return surface;
}

double flat(double, double) {
  return 0;
}

ContactPairs pairs_of(const CollisionSurface& surface) {
  collision::AllowedPairs allowed(2, 0);
  allowed.set(0, 1, 1);
  collision::Candidates candidates;
  collision::BroadPhase(surface).find(surface, surface.rest, surface.rest, d_hat, allowed,
                                      candidates);
  ContactPairs pairs;
  find_active_pairs(surface, candidates, surface.rest, d_hat, pairs);
  return pairs;
}

/// Near edges and vertices where d_hat sees several triangles, and beyond the rim.
std::vector<Vec3> points_above(const CollisionSurface& surface) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-0.05, 4.05), near(-0.08, 0.08), height(0.01, 0.09);
  std::vector<Vec3> points;
  for (int k = 0; k < 200; ++k)
    points.push_back({any(random), any(random), height(random)});
  for (std::uint32_t vertex = 0; vertex < 25; ++vertex)
    for (int k = 0; k < 20; ++k)
      points.push_back(surface.rest[vertex] + Vec3{near(random), near(random), height(random)});
  for (const auto& [a, b] : surface.edges)
    points.push_back(0.5 * (surface.rest[a] + surface.rest[b]) +
                     Vec3{0.3 * near(random), 0.3 * near(random), height(random)});
  return points;
}

TEST(ContactPairs, AFlatSurfaceCountsOnceWhereverThePointIs) {
  for (const Vec3& point : points_above(sheet_and_point({2, 2, 1}, flat))) {
    const CollisionSurface surface = sheet_and_point(point, flat);
    const ContactPairs pairs = pairs_of(surface);
    std::vector<Vec3> gradient(surface.size());
    const double energy = add_barrier_gradient(pairs, surface.rest, 1, gradient);
    const Vec3 away{point.x - std::clamp(point.x, 0.0, 4.0),
                    point.y - std::clamp(point.y, 0.0, 4.0), point.z};
    const BarrierValue expected = barrier(dot(away, away), barrier_range(d_hat, 0));
    EXPECT_NEAR(energy, expected.value, 1e-13) << point.x << ' ' << point.y << ' ' << point.z;
    const Vec3 slope = expected.first * 2 * away;
    EXPECT_LE(norm(gradient[25] - slope), 1e-12 * norm(slope) + 1e-14);
    for (std::size_t k = 0; k < 25; ++k)
      EXPECT_GE(gradient[k].z, -1e-12 * norm(slope)) << "pulled";
  }
}

TEST(ContactPairs, WithoutOverlapAPointAboveAVertexIsPushedAside) {
  CollisionSurface surface = sheet_and_point({2, 2, 1}, flat);
  const Vec3 point = surface.rest[12] + Vec3{0.02, 0.01, 0.04};
  surface = sheet_and_point(point, flat);
  surface.overlap.clear();
  std::vector<Vec3> gradient(surface.size());
  (void)add_barrier_gradient(pairs_of(surface), surface.rest, 1, gradient);
  EXPECT_GT(std::hypot(gradient[25].x, gradient[25].y), 0.1 * std::abs(gradient[25].z));
}

TEST(ContactPairs, WithARadiusEachTriangleCounts) {
  const auto valley = [](double x, double) { return 0.05 * std::abs(x - 2); };
  CollisionSurface surface = sheet_and_point({2, 1.7, 0.25}, valley);
  surface.radius[25] = 0.2;
  const ContactPairs pairs = pairs_of(surface);
  EXPECT_GE(pairs.pairs.size(), 2U);
  for (const ContactPair& pair : pairs.pairs)
    EXPECT_GE(pair.weight, 1);
}

TEST(ContactPairs, RidgesAndValleysPushAndAreContinuous) {
  for (const double slope : {-0.5, -0.05, 0.05, 0.5}) {
    const auto roof = [&](double x, double) { return slope * std::abs(x - 2); };
    double before = 0, most = 0;
    for (int k = 0; k <= 2000; ++k) {
      const Vec3 point{1.8 + 2e-4 * k, 1.7, slope * std::abs(-0.2 + 2e-4 * k) + 0.05};
      CollisionSurface surface = sheet_and_point(point, roof);
      for (std::uint32_t j = 0; j < 5; ++j) // the ridge along y
        surface.rest[5 * j + 2] = {2, surface.rest[5 * j + 2].y, 0};
      for (std::uint32_t v = 0; v < 25; ++v)
        surface.rest[v].z = roof(surface.rest[v].x, 0);
      std::vector<Vec3> gradient(surface.size());
      const double energy = add_barrier_gradient(pairs_of(surface), surface.rest, 1, gradient);
      EXPECT_LT(gradient[25].z, 0) << "not pushed";
      if (k > 0)
        most = test::larger(most, std::abs(energy - before));
      before = energy;
    }
    const double whole = barrier(0.05 * 0.05, barrier_range(d_hat, 0)).value;
    EXPECT_LT(most, 0.02 * whole) << slope;
  }
}

} // namespace
} // namespace gewebe::contact
