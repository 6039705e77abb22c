// Two organs pressed together, and a folded tube, at rest: action is reaction, nothing is in
// anything by more than 1e-3 of an edge, by a geometry of its own.

#include "mesh_fixtures.h"
#include "touching_organs.h"

#include <gtest/gtest.h>

#include <string>

namespace gewebe::test {
namespace {

using namespace test;

constexpr double cells = 5, tall = 60; ///< mm

struct Kinds {
  bool below, above; ///< whether they are solids
  double force;
};

class PressedBalls : public testing::TestWithParam<Kinds> {};

model::Model body(const TriangleMesh& surface, bool solid) {
  const model::Model inner = solid_of(stuffed(surface, cells));
  return solid ? inner : net_of(model::surface_mesh(inner));
}

void expect_fair(const Rest& rest, double force) {
  EXPECT_TRUE(rest.rests);
  EXPECT_LE(rest.off, 1e-12);
  EXPECT_LE(rest.inside.nodes, 1e-3);
  EXPECT_LE(rest.inside.edges, 1e-3);
  EXPECT_NEAR(rest.up.z, force, 1e-3 * force) << "what presses it is answered";
  EXPECT_GE(rest.touched, 3U);
}

TEST_P(PressedBalls, RestOnEachOther) {
  const Kinds kinds = GetParam();
  const model::Model below = body(sphere_mesh(3, tall / 2, {}), kinds.below),
                     above = body(sphere_mesh(3, tall / 2, {1.7, 0.9, tall + 1}), kinds.above);
  Press press;
  press.force = kinds.force;
  press.friction = 0.3;
  expect_fair(pressed_together(below, above, press), press.force);
}

TEST(Touch, BallsPassEachOtherWhereNobodySaysOtherwise) {
  const model::Model below = body(sphere_mesh(3, tall / 2, {}), true),
                     above = body(sphere_mesh(3, tall / 2, {1.7, 0.9, tall + 1}), true);
  Press press;
  press.meet = false;
  press.longest = 0.1;
  const Rest rest = pressed_together(below, above, press);
  EXPECT_GT(rest.inside.nodes, 1e-2);
}

INSTANTIATE_TEST_SUITE_P(Kinds, PressedBalls,
                         testing::Values(Kinds{true, true, 5e5}, Kinds{false, false, 3e4},
                                         Kinds{true, false, 3e4}));

/// A node that one triangle holds comes to pass another one beside it, through a ridge.
TEST(Touch, ALiverRestsOnASpleen) {
  const TriangleMesh spleen = load_test_mesh("hubmap_F_spleen_uv.obj"),
                     liver = load_test_mesh("sofa_liver_smooth.obj");
  if (spleen.triangles.empty() || liver.triangles.empty())
    GTEST_SKIP() << "needs data/hubmap_F_spleen_uv.obj and data/sofa_liver_smooth.obj";
  const model::Model below = solid_of(stuffed(placed(spleen, tall, {}), 6));
  Box3 box;
  for (const model::Node& n : below.nodes)
    box.add(n.position);
  const model::Model above = solid_of(stuffed(placed(liver, tall, {1.7, 0.9, box.max.z + 1}), 6));
  for (const bool still : {false, true}) {
    Press press;
    press.force = 5e5;
    press.still = still;
    expect_fair(pressed_together(below, above, press), press.force);
  }
}

TEST(Touch, AFoldedTubeTouchesItself) {
  const double radius = 8, apart = 22;
  const TriangleMesh tube = tube_round(hairpin(40, apart, 8.4), 6, radius);
  const model::Model model = solid_of(stuffed(tube, 9));
  for (const bool meets : {true, false}) {
    Press press;
    press.force = 5e5;
    press.meet = meets;
    const Rest rest = folded(model, ends_of(model, true), ends_of(model, false), press);
    EXPECT_TRUE(rest.rests);
    if (!meets) {
      EXPECT_GT(rest.inside.edges, 0.1) << "it passes through itself";
      continue;
    }
    EXPECT_LE(rest.inside.edges, 1e-3);
    EXPECT_LE(rest.off, 1e-12);
    EXPECT_GE(rest.touched, 6U);
    EXPECT_GT(rest.size, 1e5);
  }
}

} // namespace
} // namespace gewebe::test
