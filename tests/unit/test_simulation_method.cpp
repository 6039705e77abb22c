// Objects that are read late, change their method, and steps that are taken back.

#include "base/error.h"
#include "larger.h"
#include "simulation_scenes.h"

#include <cmath>
#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using test::free_nodes, test::one_thread, test::organ, test::shape;

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); i += 3)
    largest =
        test::larger(largest, norm(Vec3{a[i] - b[i], a[i + 1] - b[i + 1], a[i + 2] - b[i + 2]}));
  return largest;
}

/// How often an object's parts were asked for.
struct Asked {
  int model = 0, stiffness = 0;
};

scene::ObjectSource counted(Asked& asked) {
  return {[&] {
            ++asked.model;
            return organ();
          },
          [&](const model::Model&) {
            ++asked.stiffness;
            return std::shared_ptr<compliance::ComplianceSource>();
          }};
}

TEST(SimulationLazy, NothingIsReadBeforeItIsNeeded) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    std::vector<Asked> asked(4);
    scene::Simulation s(one_thread(), {});
    for (std::size_t i = 0; i < asked.size(); ++i)
      s.add_object("o" + std::to_string(i), counted(asked[i]), method);
    s.step(0.1);
    s.apply(scene::SetMethod{3, method == scene::Method::ffe ? scene::Method::ela
                                                             : scene::Method::ffe});
    s.step(0.1);
    for (const Asked& one : asked)
      EXPECT_EQ(one.model + one.stiffness, 0);
    const std::uint32_t node = free_nodes(s.model(1))[0];
    EXPECT_EQ(asked[1].model, 1);
    s.step(0.1);
    EXPECT_EQ(asked[1].stiffness, 0);
    s.apply(scene::SetForce{2, {node}, {0, 0, 10}});
    s.step(0.1);
    s.step(0.1);
    EXPECT_EQ(asked[2].model, 1);
    EXPECT_EQ(asked[2].stiffness, method == scene::Method::ffe ? 1 : 0);
    EXPECT_EQ(asked[0].model + asked[3].model, 0);
    EXPECT_TRUE(s.object(2).known && !s.object(0).known);
    EXPECT_TRUE(s.displacement(0).empty());
    EXPECT_GT(largest_difference(shape(s, 2), std::vector<double>(s.displacement(2).size())), 0);
    s.apply(scene::SetGravity{{0, 0, -1}}); // acts on all
    s.step(0.1);
    for (const Asked& one : asked)
      EXPECT_EQ(one.model, 1);
  }
}

TEST(SimulationLazy, WhatIsReadLateMovesAsWhatWasThereAtOnce) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    Asked asked;
    scene::Simulation late(one_thread(), {}), early(one_thread(), {});
    late.add_object("o", counted(asked), method);
    early.add_object("o", organ(), method);
    const std::uint32_t node = free_nodes(early.model(0))[0];
    for (scene::Simulation* s : {&late, &early}) {
      s->step(0.1);
      s->apply(scene::SetForce{0, {node}, {0, 0, 10}});
      s->step(0.01);
      s->apply(scene::Release{0, {node}});
      s->step(0.013);
    }
    EXPECT_EQ(shape(late, 0), shape(early, 0));
  }
}

TEST(SimulationMethod, AnElastostaticObjectStartsToMoveAtItsShapeAndAtRest) {
  scene::Simulation s(one_thread(), {});
  s.add_object("o", {[] { return organ(); }}, scene::Method::ffe);
  const std::uint32_t node = free_nodes(s.model(0))[0], other = free_nodes(s.model(0))[5];
  s.apply(scene::SetDisplacement{0, {node}, {0.1, 0, 0.2}});
  s.apply(scene::SetForce{0, {other}, {0, 5, 0}});
  s.step(0.1);
  const std::vector<double> still = shape(s, 0);
  s.apply(scene::SetMethod{0, scene::Method::ela});
  EXPECT_EQ(s.object(0).method, scene::Method::ela);
  s.step(0);
  EXPECT_EQ(shape(s, 0), still);
  EXPECT_EQ(s.state().kinetic_energy, 0);
  EXPECT_TRUE(s.news().jumps.empty());
  s.step(0.001);
  // It starts near its equilibrium: linear and non-linear shapes differ a little.
  EXPECT_GT(s.state().kinetic_energy, 0);
  EXPECT_LT(largest_difference(shape(s, 0), still), 0.02);
  EXPECT_EQ(s.displacement(0)[3 * std::size_t{node}], 0.1);
}

TEST(SimulationMethod, AMovingObjectTakesItsElastostaticShapeAndTellsTheJump) {
  scene::Simulation s(one_thread(), {}), same(one_thread(), {});
  s.add_object("o", {[] { return organ(); }}, scene::Method::ela);
  same.add_object("o", {[] { return organ(); }}, scene::Method::ffe);
  const std::uint32_t node = free_nodes(s.model(0))[0];
  for (scene::Simulation* one : {&s, &same}) {
    one->apply(scene::SetDisplacement{0, {node}, {0.1, 0, 0.2}});
    one->step(0.003);
  }
  const std::vector<double> moving = shape(s, 0), still = shape(same, 0);
  s.apply(scene::SetMethod{0, scene::Method::ffe});
  s.step(0);
  EXPECT_EQ(shape(s, 0), still);
  ASSERT_EQ(s.news().jumps.size(), 1U);
  EXPECT_EQ(s.news().jumps[0].size, largest_difference(moving, still));
  EXPECT_GT(s.news().jumps[0].size, 1e-3);
  EXPECT_EQ(s.counts().largest_jump, s.news().jumps[0].size);
  s.take_news();
  // There and back again, at a time; what is not touched jumps nowhere.
  s.schedule(0.01, scene::SetMethod{0, scene::Method::ela});
  s.schedule(0.01, scene::SetMethod{0, scene::Method::ffe});
  s.step(0.01);
  ASSERT_EQ(s.news().jumps.size(), 1U);
  EXPECT_EQ(s.news().jumps[0].size, 0);
  EXPECT_EQ(shape(s, 0), still);
}

TEST(SimulationMethod, RefusedWhereItCannotBe) {
  scene::Simulation s(one_thread(), {.guard = true});
  s.add_object("a", {[] { return organ(); }}, scene::Method::ela);
  s.add_object("b", {[] { return organ(); }}, scene::Method::ela);
  s.add_object("loose", {[] { return test::two_masses(); }}, scene::Method::ela);
  s.add_object("massless", {[] { return test::two_masses(0); }}, scene::Method::ffe);
  s.apply(scene::Attach{0, {1}, 1, {2}, 10});
  EXPECT_THROW(s.apply(scene::SetMethod{0, scene::Method::ffe}), Error);
  EXPECT_EQ(s.object(0).method, scene::Method::ela);
  s.apply(scene::SetForce{2, {0}, {1, 0, 0}});
  s.step(0.01);
  const std::vector<double> before = shape(s, 2);
  EXPECT_THROW(s.apply(scene::SetMethod{2, scene::Method::ffe}), Error); // nothing holds it
  EXPECT_EQ(s.object(2).method, scene::Method::ela);
  s.step(0);
  EXPECT_EQ(shape(s, 2), before);
  s.step(0.01);
  EXPECT_NE(shape(s, 2), before);
  s.apply(scene::SetMethod{3, scene::Method::ela}); // untouched
  s.apply(scene::SetForce{3, {0}, {1, 0, 0}});
  EXPECT_THROW(s.step(0.01), Error);
  s.apply(scene::Release{3, {0}});
  s.step(0.01);
}

/// Results of a scene with one object of each kind, with steps that fail in between or without.
std::vector<double> disturbed(bool with_failures) {
  scene::Simulation s(one_thread(), {.guard = true});
  s.add_object("moving", {[] { return organ(); }}, scene::Method::ela);
  s.add_object("still", {[] { return organ(); }}, scene::Method::ffe);
  s.add_object("implicit", {[] { return organ(); }}, scene::Method::ela,
               scene::Integration::implicit);
  s.add_object("partner", {[] { return organ(); }}, scene::Method::ela);
  // What moves explodes before the elastostatic objects follow, what is loose fails behind them.
  s.add_object("bomb", {[] { return test::two_masses(); }}, scene::Method::ela);
  s.add_object("loose", {[] { return test::two_masses(); }}, scene::Method::ffe);
  const std::vector<std::uint32_t> nodes = free_nodes(s.model(0));
  std::vector<double> all;
  const auto step = [&](double dt) {
    if (with_failures) {
      const double time = s.time();
      const std::size_t pending = s.pending();
      for (const std::size_t culprit : {4U, 5U}) {
        s.apply(scene::SetForce{culprit, {0}, {1e308, 0, 0}});
        EXPECT_THROW(s.step(culprit == 4 ? dt + 1 : dt / 2), Error);
        s.apply(scene::Release{culprit, {0}});
        EXPECT_EQ(s.time(), time);
        EXPECT_EQ(s.pending(), pending);
      }
    }
    s.step(dt);
    for (std::size_t i = 0; i < 4; ++i) {
      all.insert(all.end(), s.displacement(i).begin(), s.displacement(i).end());
      for (const contact::NodeVector& f : s.contact_forces(i))
        all.push_back(f.value.x);
    }
    all.push_back(s.state().kinetic_energy);
    all.push_back(s.settings().emits.forces ? 1 : 0);
    for (const scene::MethodJump& jump : s.news().jumps)
      all.push_back(jump.size);
    s.take_news();
  };
  s.apply(scene::SetForce{0, {nodes[1]}, {0, 30, 0}, 0.05});
  s.apply(scene::SetForce{1, {nodes[1]}, {0, 30, 0}});
  s.apply(scene::SetForce{2, {nodes[1]}, {0, 30, 0}});
  s.apply(scene::SetDisplacement{0, {nodes[3]}, {0, 0, 0.2}, 0.025});
  s.apply(scene::SetDisplacement{1, {nodes[3]}, {0, 0, 0.2}, 0.025});
  s.schedule(0.015, scene::Release{0, {nodes[3]}});
  s.schedule(s.time(), scene::SetForce{1, {nodes[7]}, {1, 1, 1}}, 0.008);
  s.schedule(0.021, scene::Attach{0, {nodes[2], nodes[4]}, 3, {nodes[5]}, 300});
  s.schedule(0.5, scene::Emit{true});
  s.schedule(0.022, scene::SetMethod{2, scene::Method::ffe});
  s.schedule(0.031, scene::SetMethod{1, scene::Method::ela});
  s.schedule(0.033, scene::SetMethod{2, scene::Method::ela});
  for (int k = 0; k < 8; ++k)
    step(0.007);
  step(0.5);
  return all;
}

TEST(SimulationUndo, AStepThatFailsLeavesNoTrace) {
  const std::vector<double> b = disturbed(true), a = disturbed(false);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    ASSERT_EQ(a[i], b[i]) << i;
}

TEST(SimulationUndo, WithoutGuardItLeavesOne) { // so the test above can fail
  for (const bool guard : {false, true}) {
    scene::Simulation s(one_thread(), {.guard = guard});
    s.add_object("bomb", {[] { return test::two_masses(); }}, scene::Method::ela);
    s.apply(scene::SetForce{0, {0}, {1e308, 0, 0}});
    EXPECT_THROW(s.step(10), Error);
    s.apply(scene::Release{0, {0}});
    if (guard)
      s.step(1);
    else
      EXPECT_THROW(s.step(1), Error);
  }
}

TEST(SimulationUndo, AnEventThatFailsStaysUntilItCanHappen) {
  scene::Simulation s(one_thread(), {.guard = true});
  s.add_object("a", {[] { return organ(); }}, scene::Method::ela);
  s.add_object("b", {[] { return organ(); }}, scene::Method::ela);
  s.schedule(0.01, scene::Emit{true});
  s.schedule(0.02, scene::Attach{0, {1}, 1, {2}, 10});
  s.apply(scene::SetMethod{1, scene::Method::ffe});
  EXPECT_THROW(s.step(0.03), Error);
  EXPECT_EQ(s.pending(), 2U);
  EXPECT_FALSE(s.settings().emits.forces);
  EXPECT_EQ(s.time(), 0);
  s.step(0.015);
  EXPECT_TRUE(s.settings().emits.forces);
  EXPECT_THROW(s.step(0.015), Error);
  s.apply(scene::SetMethod{1, scene::Method::ela});
  s.step(0.015);
  EXPECT_EQ(s.pending(), 0U);
}

/// Nodes in a row, each tied to the next three, every 50th held.
model::Model rope(std::uint32_t n) {
  model::Model m;
  m.name = "rope";
  m.materials.resize(1);
  m.materials[0].name = "m";
  m.nodes.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    m.nodes[i].position = {0.5 * i, i % 2 == 0 ? 0.0 : 1.0, i % 4 < 2 ? 0.0 : 1.0};
    m.nodes[i].mass = 1;
    m.nodes[i].fixed = i % 50 == 0 ? model::fixed_all : model::fixed_none;
  }
  for (std::uint32_t i = 0; i + 1 < n; ++i)
    for (std::uint32_t j = i + 1; j < std::min(n, i + 4); ++j)
      m.springs.push_back({i, j, model::SpringKind::edge, 10, 0.1,
                           norm(m.nodes[j].position - m.nodes[i].position)});
  for (std::uint32_t i = 0; i + 2 < n; ++i)
    m.triangles.push_back({i, i + 1, i + 2});
  return m;
}

TEST(SimulationContacts, AMillionAreOnlyMany) {
  const std::uint32_t n = 1000000;
  scene::Simulation s(one_thread(), {});
  s.add_object("rope", {[] { return rope(n); }}, scene::Method::ela);
  s.add_object("organ", {[] { return organ(4); }}, scene::Method::ffe);
  scene::SetDisplacement all{0, {}, {0, 0, 0.01}};
  for (std::uint32_t i = 0; i < n; ++i)
    if (i % 50 != 0)
      all.nodes.push_back(i);
  s.apply(all);
  s.apply(scene::SetDisplacement{1, free_nodes(s.model(1)), {0, 0, 0.01}});
  s.step(0.001);
  ASSERT_EQ(s.contact_forces(0).size(), all.nodes.size());
  ASSERT_EQ(s.contact_forces(1).size(), free_nodes(s.model(1)).size());
  std::size_t wrong = 0;
  for (const std::size_t object : {0U, 1U}) {
    const std::vector<double> u = shape(s, object);
    for (const contact::NodeVector& f : s.contact_forces(object))
      wrong += u[3 * std::size_t{f.node} + 2] == 0.01 ? 0 : 1;
  }
  EXPECT_EQ(wrong, 0U);
  s.apply(scene::Release{0, all.nodes});
  s.step(0);
  EXPECT_TRUE(s.contact_forces(0).empty());
}

} // namespace
} // namespace gewebe::test
