// Impulses between instruments and what has mass.

#include "dynamics/contact_impulses_internal.h"

#include <array>
#include <gtest/gtest.h>

namespace gewebe {
namespace {

constexpr double step = 1e-3;

/// A node of mass 1 on a sphere, on the line from its middle along `way`.
struct NodeOnSphere {
  NodeOnSphere(const Vec3& way, double friction)
      : points{.place = {2 / norm(way) * way},
               .velocity = {Vec3{}},
               .inverse_mass = {Vec3{1, 1, 1}},
               .inward = {way},
               .pieces = {Facet{0, 0, 0}}},
        cores{{{PlacedInstrument({.radius = 2, .axis = {}, .friction = friction}, {}),
                {},
                {},
                step}}},
        touches{{{.point = {.weights = {1, 0, 0},
                            .place = points.place[0],
                            .core = {},
                            .distance = 2,
                            .out = {}},
                  .normal = way / norm(way),
                  .impulse = {}}}} {}
  MassPoints points;
  std::array<MovingCore, 1> cores;
  std::array<PieceTouch, 1> touches;
};

TEST(ContactImpulses, WhatGoesAwayIsPushedByNothingAtAll) {
  for (const double friction : {0.0, 0.3})
    for (const Vec3& way : {Vec3{1, 0.3, -0.7}, Vec3{0.1, 0.9, 0.2}, Vec3{-3, 1, 7}}) {
      NodeOnSphere on(way, friction);
      const Vec3 n = on.touches[0].normal;
      on.touches[0].impulse = 600.0 / 7 * n; // as it pushed in the step before
      on.points.velocity[0] = 1e4 * n;
      exchange_impulses(on.points, on.cores, on.touches, 1e-6, 100);
      EXPECT_EQ(on.touches[0].impulse, (Vec3{}));
      EXPECT_LE(norm(on.points.velocity[0] - 1e4 * n), 1e-11 * 1e4);
    }
}

TEST(ContactImpulses, WhatComesIsStoppedAlongTheNormal) {
  NodeOnSphere on({1, 0.3, -0.7}, 0);
  const Vec3 n = on.touches[0].normal, across{0.3, -1, 0};
  on.points.velocity[0] = across - 5 * n;
  exchange_impulses(on.points, on.cores, on.touches, 1e-12, 100);
  EXPECT_LE(norm(on.touches[0].impulse - 5 * n), 1e-12 * 5);
  EXPECT_LE(norm(on.points.velocity[0] - across), 1e-12 * 5);
}

} // namespace
} // namespace gewebe
