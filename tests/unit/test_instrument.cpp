#include "contact/instrument.h"

#include "contact/instrument_surface.h"
#include "contact/load.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "sim_models.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <memory>
#include <set>
#include <vector>

namespace gewebe::test {
namespace {

const double half = std::sqrt(0.5);

TEST(Instrument, TurnsAreRotations) {
  const contact::Quaternion quarter = contact::turn_about({0, 0, 2}, 90);
  EXPECT_LT(norm(contact::rotated(quarter, {1, 2, 3}) - Vec3{-2, 1, 3}), 1e-15);
  EXPECT_LT(
      norm(contact::rotated_back(quarter, contact::rotated(quarter, {1, 2, 3})) - Vec3{1, 2, 3}),
      1e-15);
  EXPECT_EQ(contact::unit({0, 0, 0, 1e-200}), (contact::Quaternion{0, 0, 0, 1}));
  EXPECT_EQ(contact::unit({1e300, 0, 0, 0}), contact::Quaternion{});
  const contact::Pose pose{{5, 0, 0}, quarter};
  EXPECT_LT(norm(pose({1, 0, 0}) - Vec3{5, 1, 0}), 1e-15);
  EXPECT_LT(norm(pose.inverse(pose({1, 2, 3})) - Vec3{1, 2, 3}), 1e-15);
}

TEST(Instrument, AWayIsSmoothAndTakesTheShorterTurn) {
  contact::Quaternion end = contact::turn_about({0, 0, 1}, 90);
  end = {-end.w, -end.x, -end.y, -end.z}; // the same turn
  const contact::PoseWay way{{}, {{2, 0, 0}, end}, 1, 3};
  EXPECT_EQ(way.at(0), way.from);
  EXPECT_EQ(way.at(1), way.from);
  EXPECT_EQ(way.at(3), way.to);
  EXPECT_EQ(way.at(9), way.to);
  const contact::Pose middle = way.at(2);
  EXPECT_LT(norm(middle.place - Vec3{1, 0, 0}), 1e-15);
  EXPECT_LT(norm(contact::rotated(middle.turn, {1, 0, 0}) - Vec3{half, half, 0}), 1e-15);
  EXPECT_LT(norm(way.at(1.01).place), 2e-4); // slow at first
  const contact::PoseWay jump{{}, {{2, 0, 0}, {}}, 1, 1};
  EXPECT_EQ(jump.at(1), jump.to);
}

TEST(Instrument, DistancesOfSphereAndCapsule) {
  const contact::PlacedInstrument sphere({2, {}, 0}, {{1, 0, 0}, {}});
  EXPECT_EQ(sphere.distance({1, 0, 5}), 3);
  EXPECT_EQ(sphere.distance({1, 0.5, 0}), -1.5);
  EXPECT_EQ(sphere.normal({1, 0.5, 0}), (Vec3{0, 1, 0}));
  EXPECT_EQ(sphere.support({0, 0, -1}), 2);
  // Turned so that its segment goes from (1, 0, 0) to (1, 4, 0).
  const contact::PlacedInstrument capsule({1, {4, 0, 0}, 0},
                                          {{1, 0, 0}, contact::turn_about({0, 0, 1}, 90)});
  EXPECT_NEAR(capsule.distance({1, 7, 0}), 2, 1e-14);
  EXPECT_NEAR(capsule.distance({1, -1, 0}), 0, 1e-14);
  EXPECT_NEAR(capsule.distance({3, 2, 0}), 1, 1e-14);
  EXPECT_NEAR(capsule.support({0, 1, 0}), 5, 1e-14);
  EXPECT_NEAR(capsule.support({0, -1, 0}), 1, 1e-14);
  const Box3 box = capsule.box();
  EXPECT_LT(norm(box.min - Vec3{0, -1, -1}) + norm(box.max - Vec3{2, 5, 1}), 1e-14);
}

TEST(Instrument, WhereThereIsNoNormalTheWishIsTaken) {
  const contact::PlacedInstrument sphere({2, {}, 0}, {{1, 0, 0}, {}});
  EXPECT_EQ(sphere.normal({1, 0, 0}, {0, -3, 0}), (Vec3{0, -1, 0}));
  EXPECT_EQ(norm(sphere.normal({1, 0, 0})), 1);
  const contact::PlacedInstrument capsule({1, {4, 0, 0}, 0}, {});
  EXPECT_LT(norm(capsule.normal({2, 0, 0}, {5, 0, 2}) - Vec3{0, 0, 1}), 1e-15);
  for (const Vec3 wish : {Vec3{}, Vec3{1, 0, 0}}) {
    const Vec3 n = capsule.normal({2, 0, 0}, wish);
    EXPECT_NEAR(norm(n), 1, 1e-15);
    EXPECT_NEAR(n.x, 0, 1e-15);
  }
}

TEST(Instrument, BeyondAnySupportPlaneIsOutside) {
  const contact::PlacedInstrument capsule({0.7, {1, 2, 3}, 0},
                                          {{4, 5, 6}, contact::turn_about({1, 1, 0}, 33)});
  for (int k = 0; k < 500; ++k) {
    const Vec3 v{std::sin(1.0 * k), std::sin(1.7 * k + 1), std::sin(2.3 * k + 2)};
    const Vec3 n = v / norm(v), across = cross(n, {0.3, 0.4, 0.5});
    const Vec3 p = capsule.support(n) * n + 3 * std::sin(5.1 * k) * across;
    EXPECT_GE(capsule.distance(p), -1e-12);
    EXPECT_GE(capsule.support(n), dot(n, capsule.a) + capsule.radius);
  }
}

TEST(Instrument, NoPointMovesFurther) {
  const contact::InstrumentShape shape{0.5, {3, 0, 0}, 0};
  for (const double degrees : {0.0, 1.0, 45.0, 179.0, 180.0}) {
    const contact::Pose from{{1, 2, 3}, contact::turn_about({0, 1, 0}, 20)};
    const contact::Pose to{{1.5, 2, 2}, contact::turn_about({0.1, 1, 0.3}, 20 + degrees)};
    double way = 0;
    Vec3 before = from(shape.axis);
    for (int k = 1; k <= 1000; ++k) {
      const Vec3 now = contact::between(from, to, k / 1000.0)(shape.axis);
      way += norm(now - before);
      before = now;
    }
    EXPECT_LE(way, contact::path_length(shape, from, to) * (1 + 1e-9));
    EXPECT_GE(way, norm(to.place - from.place) / 4);
  }
  EXPECT_EQ(contact::path_length(shape, {}, {}), 0);
}

TEST(Instrument, ACarriedNodeFollowsTheTurn) {
  const Vec3 rest{1, 0, 0};
  const contact::PoseWay way{{}, {{0, 0, 2}, contact::turn_about({0, 0, 1}, 180)}, 0, 1};
  const contact::Ramp ramp{{}, {-2, 0, 2}, 0, 1, contact::Carrier{way, rest, rest}};
  EXPECT_EQ(ramp.at(0), Vec3{});
  EXPECT_EQ(ramp.at(1), (Vec3{-2, 0, 2}));
  const Vec3 middle = rest + ramp.at(0.5);
  EXPECT_LT(norm(middle - Vec3{0, 1, 1}), 1e-15); // on the circle, not through its middle
}

TEST(Instrument, ItsSurfaceIsClosedRoundAndItsOwn) {
  for (const Vec3& axis : {Vec3{}, Vec3{0, 0, 7}, Vec3{3, -4, 12}, Vec3{0, -1e-3, 0}})
    for (const std::size_t along : {std::size_t{1}, std::size_t{5}})
      for (const std::size_t around : {std::size_t{4}, std::size_t{32}, std::size_t{128}}) {
        const double radius = 2.5, pi = std::acos(-1.0);
        const contact::InstrumentSurface made = contact::round_surface(radius, axis, around, along);
        const contact::PlacedInstrument placed({.radius = radius, .axis = axis}, {});
        ASSERT_EQ(made.points.size(), made.normals.size());
        for (std::size_t i = 0; i < made.points.size(); ++i) {
          EXPECT_LT(std::fabs(placed.distance(made.points[i])), 1e-14);
          EXPECT_LT(norm(placed.normal(made.points[i]) - made.normals[i]), 1e-14);
        }
        // Each edge once in each direction, and what is inside by the triangles' order.
        std::set<std::array<std::uint32_t, 2>> edges;
        for (const Triangle& t : made.triangles)
          for (std::size_t c = 0; c < 3; ++c)
            EXPECT_TRUE(edges.insert({t[c], t[(c + 1) % 3]}).second);
        for (const auto& [a, b] : edges)
          EXPECT_TRUE(edges.contains({b, a}));
        TriangleMesh mesh;
        mesh.points = made.points;
        mesh.triangles = made.triangles;
        const double volume = pi * radius * radius * (norm(axis) + 4 * radius / 3);
        const double missing = 1 - signed_volume(mesh) / volume;
        const auto n = static_cast<double>(around);
        EXPECT_GT(missing, 0);
        EXPECT_LT(missing, 20 / (n * n));
      }
}

} // namespace
} // namespace gewebe::test
