// Surfaces that touch each other or themselves, in scenes: nobody is pulled, nothing passes,
// action is reaction.

#include "base/context.h"
#include "base/error.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "tet_fixtures.h"
#include "touching_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using namespace test;

constexpr double edge = block_edge;

TEST(SimulationMeetings, ABlockRestsOnAnother) {
  for (const double friction : {0.0, 0.3}) {
    scene::Simulation s(one_thread(), {});
    add(s, "below", block(5, 5, 2, {}, true));
    add(s, "above", block(3, 3, 2, {3.7, 4.1, 8.3}));
    s.apply(scene::SetGravity{{0, 0, -9810}});
    s.apply(scene::SetTimestep{1.0 / 600});
    s.apply(scene::SetContact{0, 1, friction});
    for (int k = 0; k < 16; ++k) {
      s.step(1.0 / 60);
      EXPECT_GT(least_gap(s, 0, 1), 0);
      const Vec3 up = sum_of_forces(s, 1), sum = up + sum_of_forces(s, 0);
      EXPECT_GE(up.z, 0);
      EXPECT_LE(norm(sum), 1e-12 * norm(up));
      EXPECT_LE(std::hypot(up.x, up.y), (friction + 0.05) * up.z); // it isn't quite even
    }
    EXPECT_NEAR(sum_of_forces(s, 1).z, weight_of(s, 1), 1e-4 * weight_of(s, 1));
    EXPECT_LE(least_gap(s, 0, 1), gap_allowed);
    // 1e-5 g mm^2/s^2 is a speed of 0.004 mm/s, of 0.1 mm/s at which what sticks may creep.
    EXPECT_EQ(s.state().kinetic_energy<1e-5, friction> 0) << "it slides where nothing rubs";
  }
}

/// Of its step, in g mm/s.
Vec3 momentum(scene::Simulation& s, double h) {
  std::vector<std::vector<double>> before;
  for (std::size_t i = 0; i < s.object_count(); ++i)
    before.push_back(test::shape(s, i));
  s.step(h);
  Vec3 sum;
  for (std::size_t i = 0; i < s.object_count(); ++i) {
    const std::vector<double> now = test::shape(s, i);
    for (std::size_t k = 0; k < s.model(i).nodes.size(); ++k)
      sum += s.model(i).nodes[k].mass / h * (vector_at(now, k) - vector_at(before[i], k));
  }
  return sum;
}

/// Columns of compliance are dropped where memory is short: the same bytes; where not even those of
/// one system have room, the step is refused.
TEST(SimulationMeetings, ColumnsOfComplianceStayWithinTheMemory) {
  const auto shape_after = [](std::uint64_t memory) {
    Context context = one_thread();
    context.max_memory = memory;
    scene::Simulation s(context, {});
    add(s, "below", block(5, 5, 2, {}, true));
    add(s, "above", block(3, 3, 2, {3.7, 4.1, 8.02}));
    s.apply(scene::SetGravity{{3000, 0, -9810}});
    s.apply(scene::SetTimestep{1.0 / 200});
    s.apply(scene::SetContact{0, 1, 0.1});
    for (int k = 0; k < 12; ++k)
      s.step(1.0 / 200);
    return test::shape(s, 1);
  };
  EXPECT_EQ(shape_after(900'000), shape_after(UINT64_MAX));
  EXPECT_THROW((void)shape_after(400'000), Error);
}

/// Contact forces are those that a body moves by, in each step, at large steps too: mass times
/// acceleration less weight.
TEST(SimulationMeetings, ABlockSlidesByTheForcesThatAreShown) {
  scene::Simulation s(one_thread(), {});
  add(s, "slope", block(9, 5, 2, {}, true));
  model::Model above = block(3, 3, 2, {3.7, 4.1, 8.01});
  for (model::Node& n : above.nodes)
    n.drag = 0;
  add(s, "block", above);
  const double h = 1.0 / 60, weight = weight_of(s, 1), mass = weight / 9810;
  const Vec3 gravity{9810 * std::sin(0.17), 0, -9810 * std::cos(0.17)};
  s.apply(scene::SetGravity{gravity});
  s.apply(scene::SetTimestep{h});
  s.apply(scene::SetContact{0, 1, 0});
  std::vector<Vec3> at;
  const auto centre = [&] {
    Vec3 sum;
    const std::vector<double> u = test::shape(s, 1);
    for (std::size_t k = 0; k < above.nodes.size(); ++k)
      sum += s.model(1).nodes[k].mass / mass * (above.nodes[k].position + vector_at(u, k));
    return sum;
  };
  for (int k = 0; k < 9; ++k) {
    s.step(h);
    at.push_back(centre());
    if (k < 2)
      continue;
    const Vec3 acceleration =
        (at[at.size() - 1] - 2.0 * at[at.size() - 2] + at[at.size() - 3]) / (h * h);
    EXPECT_LE(norm(sum_of_forces(s, 1) - mass * (acceleration - gravity)), 5e-4 * weight) << k;
  }
}

TEST(SimulationMeetings, BodiesThatCollideKeepTheirMomentum) {
  scene::Simulation s(one_thread(), {});
  model::Model fast = block(2, 2, 2, {}), slow = block(3, 2, 2, {14, 1.5, 2.5});
  for (model::Model* const m : {&fast, &slow})
    for (model::Node& n : m->nodes)
      n.drag = 0;
  add(s, "fast", fast);
  add(s, "slow", slow);
  const double h = 1e-3;
  s.apply(scene::SetTimestep{h});
  s.apply(scene::SetContact{0, 1, 0.2});
  s.apply(scene::SetForce{0, nodes_of(fast), {500, 20, 0}});
  for (int k = 0; k < 20; ++k)
    s.step(h);
  s.apply(scene::Release{0, nodes_of(fast)});
  s.step(h);
  const Vec3 before = momentum(s, h);
  double pushed = 0, least = HUGE_VAL;
  for (int k = 0; k < 100; ++k) {
    const Vec3 now = momentum(s, h);
    EXPECT_LE(norm(now - before), 1e-9 * norm(before)) << k;
    pushed = test::larger(pushed, sum_of_forces(s, 1).x);
    EXPECT_LE(norm(sum_of_forces(s, 0) + sum_of_forces(s, 1)), 1e-12 * pushed);
    least = test::smaller(least, least_gap(s, 0, 1));
  }
  EXPECT_GT(pushed, 0);
  EXPECT_GT(least, 0);
}

/// A ball of 10 mm radius on tetrahedra that meet in its middle.
model::Model solid_ball(const Vec3& center) {
  const TriangleMesh surface = test::ball(2, 10, center);
  tetrahedra::TetMesh mesh;
  mesh.points = surface.points;
  mesh.points.push_back(center);
  const auto middle = static_cast<std::uint32_t>(surface.points.size());
  for (const Triangle& t : surface.triangles)
    mesh.tetrahedra.push_back({t[1], t[0], t[2], middle});
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.4}};
  options.quadratic = false;
  return fem::solid_model(mesh, options, {});
}

TEST(SimulationMeetings, ABallFallsOnAHeldPlate) {
  scene::Simulation s(one_thread(), {});
  add(s, "plate", block(6, 6, 1, {}, true));
  add(s, "ball", solid_ball({11.3, 12.1, 15}));
  s.apply(scene::SetGravity{{0, 0, -9810}});
  s.apply(scene::SetContact{1, 0, 0.5});
  double least = HUGE_VAL, hardest = 0, mean = 0;
  for (int k = 0; k < 30; ++k) {
    s.step(1.0 / 60);
    least = test::smaller(least, least_gap(s, 0, 1));
    const Vec3 up = sum_of_forces(s, 1);
    hardest = test::larger(hardest, up.z);
    mean += k < 15 ? 0 : up.z / 15;
    EXPECT_GE(up.z, 0);
  }
  EXPECT_GT(least, 0);
  EXPECT_GT(hardest, 2 * weight_of(s, 1)) << "it falls";
  EXPECT_NEAR(mean, weight_of(s, 1), 1e-2 * weight_of(s, 1));
}

/// Two arms along x, one element apart, held at their lower side.
model::Model clamp() {
  tetrahedra::TetMesh mesh = test::box_tetrahedra(8, 2, 5, edge);
  std::vector<Tetrahedron> kept;
  for (const Tetrahedron& t : mesh.tetrahedra) {
    Vec3 middle;
    for (const std::uint32_t i : t)
      middle += 0.25 * mesh.points[i];
    if (middle.x < 2 * edge || middle.z < 2 * edge || middle.z > 3 * edge)
      kept.push_back(t);
  }
  std::vector<std::uint32_t> number(mesh.points.size(), 0);
  for (const Tetrahedron& t : kept)
    for (const std::uint32_t i : t)
      number[i] = 1;
  tetrahedra::TetMesh some;
  for (std::size_t i = 0; i < number.size(); ++i)
    if (number[i] != 0) {
      number[i] = static_cast<std::uint32_t>(some.points.size());
      some.points.push_back(mesh.points[i]);
    }
  for (Tetrahedron t : kept) {
    for (std::uint32_t& i : t)
      i = number[i];
    some.tetrahedra.push_back(t);
  }
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.4}};
  options.quadratic = false;
  model::Model model = fem::solid_model(some, options, {});
  for (model::Node& node : model.nodes)
    if (node.position.z == 0)
      node.fixed = model::fixed_all;
  return model;
}

std::vector<std::uint32_t> tip_of(const model::Model& model) {
  std::vector<std::uint32_t> tip;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (model.nodes[i].position.x == 8 * edge && model.nodes[i].position.z == 5 * edge)
      tip.push_back(i);
  return tip;
}

TEST(SimulationMeetings, TheArmsOfAClampTouch) {
  for (const bool meets : {true, false}) {
    scene::Simulation s(one_thread(), {});
    const model::Model model = clamp();
    add(s, "clamp", model);
    if (meets)
      s.apply(scene::SetContact{0, 0, 0.3});
    s.apply(scene::SetForce{0, tip_of(model), {0, 0, -4e3}});
    double least = HUGE_VAL;
    for (int k = 0; k < 20; ++k) {
      s.step(1.0 / 60);
      least = test::smaller(least, least_gap(s, 0, 0));
    }
    EXPECT_LE(norm(sum_of_forces(s, 0)), 1e-9) << "what it does to itself, of some 1e4";
    if (meets) {
      EXPECT_GT(least, 0);
      EXPECT_LE(least_gap(s, 0, 0), gap_allowed);
      EXPECT_GE(s.contact_forces(0).size(), 4U);
    } else {
      EXPECT_LT(least, 0) << "they pass each other where nobody says otherwise";
    }
  }
}

TEST(SimulationMeetings, AnInstrumentPressesOneObjectOntoAnother) {
  for (const double friction : {0.0, 0.4}) {
    scene::Simulation s(one_thread(), {});
    add(s, "below", block(4, 4, 1, {}, true));
    add(s, "above", block(2, 2, 1, {3.7, 4.1, 4.1}));
    s.apply(scene::SetTimestep{1.0 / 600});
    s.apply(scene::SetContact{0, 1, 0.3});
    scene::SetInstrument ball;
    ball.name = "probe";
    ball.shape.radius = 6;
    ball.shape.friction = friction;
    ball.pose.place = {7.7, 8.1, 14.3};
    s.apply(ball);
    s.apply(scene::MoveInstrument{0, {7.7, 8.1, 13.1}, {}, 0.1});
    for (int k = 0; k < 12; ++k) {
      s.step(1.0 / 60);
      EXPECT_GT(least_gap(s, 0, 1), 0);
      double depth = 0;
      const contact::PlacedInstrument probe(s.instrument(0).shape, s.instrument(0).pose);
      const std::vector<double> u = test::shape(s, 1);
      for (std::size_t i = 0; i < s.model(1).nodes.size(); ++i)
        depth =
            test::larger(depth, -probe.distance(s.model(1).nodes[i].position + vector_at(u, i)));
      EXPECT_LE(depth, depth_allowed * 6);
    }
    // What the probe presses with goes through to the lower block.
    const Vec3 probe = s.instrument(0).force, below = sum_of_forces(s, 0);
    EXPECT_GT(probe.z, 1e4);
    EXPECT_LE(norm(probe + below), 1e-4 * norm(probe));
  }
}

TEST(SimulationMeetings, WhatIsFarApartMovesAlone) {
  const auto rounds = [](bool meets, double away) {
    scene::Simulation s(one_thread(), {});
    add(s, "below", block(5, 5, 2, {}, true));
    add(s, "above", block(3, 3, 2, {3.7, 4.1, 8.3 + away}));
    s.apply(scene::SetGravity{{0, 0, -9810}});
    if (meets)
      s.apply(scene::SetContact{0, 1, 0.2});
    for (int k = 0; k < 5; ++k)
      s.step(1.0 / 60);
    EXPECT_EQ(s.counts().contact.steps > 0, meets && away == 0);
    return std::pair(s.counts().solids.rounds, s.counts().integration);
  };
  EXPECT_EQ(rounds(true, 500), rounds(false, 500));
  EXPECT_NE(rounds(true, 0), rounds(false, 0));
}

/// A step that fails leaves all as it was, though bodies were joined in it.
TEST(SimulationMeetings, AStepThatFailsIsTakenBack) {
  const auto run = [](bool fail) {
    scene::Simulation s(one_thread(), {.guard = true});
    add(s, "below", block(4, 4, 1, {}, true));
    add(s, "above", block(2, 2, 1, {3.7, 4.1, 12}));
    add(s, "apart", block(1, 1, 1, {300, 0, 0}, true));
    s.apply(scene::SetGravity{{0, 0, -9810}});
    s.apply(scene::SetContact{0, 1, 0.2});
    for (int k = 0; k < 6; ++k) {
      if (fail) {
        s.apply(scene::SetForce{2, {7}, {1e45, 0, 0}});
        EXPECT_THROW(s.step(1.0 / 60), Error);
        s.apply(scene::Release{2, {7}});
      }
      s.step(1.0 / 60);
    }
    EXPECT_GT(s.counts().contact.steps, 0U);
    return test::shape(s, 1);
  };
  const std::vector<double> once = run(false), again = run(true);
  double most = 0;
  for (std::size_t k = 0; k < once.size(); ++k)
    most = test::larger(most, std::abs(once[k] - again[k]));
  EXPECT_LE(most, 1e-3 * edge); // within what a step leaves: what was learned is forgotten
}

TEST(SimulationMeetings, WhatIsCutOffTouchesStill) {
  scene::Simulation s(one_thread(), {});
  model::Model organ = test::soft_organ();
  for (model::Node& n : organ.nodes)
    n.drag = n.mass;
  add(s, "organ", organ);
  add(s, "plate", block(3, 3, 1, {94, -56, 50.1}));
  s.apply(scene::SetContact{0, 1, 0});
  s.apply(scene::SetContact{0, 0, 0});
  s.apply(scene::SetGravity{{0, 0, -9810}});
  s.step(1.0 / 60);
  s.apply(test::lobe_off());
  ASSERT_EQ(s.object_count(), 3U);
  for (int k = 0; k < 2; ++k) {
    s.step(1.0 / 120);
    EXPECT_GT(least_gap(s, 0, 2), 0) << "between the rims of the wound";
  }
  const Vec3 plate = sum_of_forces(s, 1);
  EXPECT_GT(plate.z, 0) << "it lies on what came off";
  EXPECT_GT(least_gap(s, 1, 2), 0);
  EXPECT_LE(norm(plate + sum_of_forces(s, 0) + sum_of_forces(s, 2)), 1e-10 * norm(plate));
}

} // namespace
} // namespace gewebe::test
