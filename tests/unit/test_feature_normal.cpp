#include "collision/feature_normal.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <numbers>

namespace gewebe::collision {
namespace {

/// Two faces along an edge from vertex 0 to 1, the second one bent down by `angle`.
CollisionSurface ridge(double angle) {
  CollisionSurface surface;
  surface.rest = {{0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {std::cos(angle), 0, -std::sin(angle)}};
  surface.triangles = {{0, 1, 2}, {1, 0, 3}};
  complete_surface(surface);
  return surface;
}

TEST(FeatureNormal, OfAFlatSurfaceItIsTheNormalWhateverTheDirection) {
  const CollisionSurface surface = ridge(0);
  for (const Vec3& direction : {Vec3{0, 0, 1}, Vec3{0.6, 0, 0.8}, Vec3{0, 0.8, 0.6}}) {
    for (const auto& feature : {std::array<std::uint32_t, 2>{0, 1}, {0, 0}, {3, 3}}) {
      const FeatureNormal n = feature_normal(surface, surface.rest, feature, direction);
      EXPECT_NEAR(norm(n.normal - Vec3{0, 0, 1}), 0, 1e-15);
      EXPECT_DOUBLE_EQ(n.flat, 1);
    }
    const FeatureNormal back =
        feature_normal(surface, surface.rest, std::array<std::uint32_t, 1>{0}, -direction);
    EXPECT_NEAR(norm(back.normal + Vec3{0, 0, 1}), 0, 1e-15) << "the back of a sheet";
  }
}

TEST(FeatureNormal, AtARimTheFaceCountsThatTheDirectionMeets) {
  const CollisionSurface surface = ridge(std::numbers::pi / 2); // the second face looks along x
  const std::array<std::uint32_t, 2> edge{0, 1};
  const double tilt = 0.2;
  const FeatureNormal n =
      feature_normal(surface, surface.rest, edge, {std::sin(tilt), 0, std::cos(tilt)});
  EXPECT_NEAR(n.normal.x / n.normal.z, std::pow(std::tan(tilt), 8), 1e-12);
  EXPECT_NEAR(n.flat, std::sqrt(0.5), 1e-15);
}

TEST(FeatureNormal, OfAnEdgeOnlyItsOwnFacesCount) {
  const CollisionSurface surface = ridge(0.3);
  const FeatureNormal side =
      feature_normal(surface, surface.rest, std::array<std::uint32_t, 2>{0, 2}, {0, 0, 1});
  EXPECT_NEAR(norm(side.normal - Vec3{0, 0, 1}), 0, 1e-15);
  EXPECT_DOUBLE_EQ(side.flat, 1);
}

TEST(FeatureNormal, NoneWithoutTriangles) {
  CollisionSurface surface = ridge(0);
  surface.rest.push_back({0, 0, 1});
  surface.points = {4};
  surface.owner.push_back(1);
  surface.radius.push_back(0.5);
  complete_surface(surface);
  const FeatureNormal n =
      feature_normal(surface, surface.rest, std::array<std::uint32_t, 1>{4}, {0, 0, 1});
  EXPECT_EQ(n.normal, Vec3{});
  EXPECT_EQ(n.flat, 0);
}

} // namespace
} // namespace gewebe::collision
