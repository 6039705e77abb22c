#include "collision/surface_normal.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <numbers>
#include <vector>

namespace gewebe::collision {
namespace {

/// Two faces along an edge from vertex 0 to 1, the second one turned down by `angle`.
CollisionSurface ridge(double angle) {
  CollisionSurface surface;
  surface.rest = {{0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {std::cos(angle), 0, -std::sin(angle)}};
  surface.triangles = {{0, 1, 2}, {1, 0, 3}};
  complete_surface(surface);
  return surface;
}

SurfaceNormal normal_at(const CollisionSurface& surface, const std::vector<std::uint32_t>& vertices,
                        const std::vector<double>& weights, const Vec3& direction) {
  return surface_normal(surface, surface.rest, vertices, weights, direction);
}

TEST(SurfaceNormal, OfAFlatSurfaceItIsTheSameWhateverTheDirection) {
  const CollisionSurface surface = ridge(0);
  for (const Vec3& direction : {Vec3{0, 0, 1}, Vec3{0.6, 0, 0.8}, Vec3{0, 0.8, 0.6}})
    for (const double side : {1.0, -1.0}) {
      const SurfaceNormal vertex = normal_at(surface, {3}, {-1}, side * direction),
                          edge = normal_at(surface, {0, 1}, {0.3, 0.7}, side * direction);
      EXPECT_NEAR(norm(vertex.normal - Vec3{0, 0, side}), 0, 1e-15) << "front and back of a sheet";
      EXPECT_NEAR(norm(edge.normal - Vec3{0, 0, side}), 0, 1e-15);
      EXPECT_DOUBLE_EQ(vertex.flat, 1);
      EXPECT_DOUBLE_EQ(edge.flat, 1);
    }
}

TEST(SurfaceNormal, AtARimTheFaceCountsThatTheDirectionMeets) {
  const CollisionSurface surface = ridge(std::numbers::pi / 2); // the second face looks along x
  const double tilt = 0.2;
  const SurfaceNormal n =
      normal_at(surface, {0, 1}, {0.5, 0.5}, {std::sin(tilt), 0, std::cos(tilt)});
  EXPECT_NEAR(n.normal.x / n.normal.z, std::pow(std::tan(tilt), 8), 1e-12);
  EXPECT_NEAR(n.flat, std::sqrt(0.5), 1e-15);
}

TEST(SurfaceNormal, IsInterpolatedBetweenVertices) {
  const CollisionSurface surface = ridge(0.3);
  const Vec3 up{0, 0, 1};
  const SurfaceNormal ridge_end = normal_at(surface, {0}, {1}, up),
                      side = normal_at(surface, {2}, {1}, up),
                      between = normal_at(surface, {0, 2}, {-0.25, -0.75}, up);
  EXPECT_NEAR(norm(side.normal - up), 0, 1e-15);
  const Vec3 expected = 0.25 * ridge_end.normal + 0.75 * side.normal;
  EXPECT_NEAR(norm(between.normal - expected / norm(expected)), 0, 1e-15);
  EXPECT_NEAR(between.flat, 0.25 * ridge_end.flat + 0.75, 1e-15);
  EXPECT_NEAR(ridge_end.flat, std::cos(0.15), 1e-15);
}

TEST(SurfaceNormal, NoneWithoutTriangles) {
  CollisionSurface surface = ridge(0);
  surface.rest.push_back({0, 0, 1});
  surface.points = {4};
  surface.owner.push_back(1);
  surface.radius.push_back(0.5);
  complete_surface(surface);
  const SurfaceNormal n = normal_at(surface, {4}, {1}, {0, 0, 1});
  EXPECT_EQ(n.normal, Vec3{});
  EXPECT_EQ(n.flat, 0);
}

} // namespace
} // namespace gewebe::collision
