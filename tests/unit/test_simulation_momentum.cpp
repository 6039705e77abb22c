// What a cut frees of an elastostatic object goes on as fast as it was moved.

#include "base/error.h"
#include "simulation_scenes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <variant>
#include <vector>

namespace gewebe::test {
namespace {

using test::free_nodes, test::highest, test::lobe_off, test::one_thread, test::shape,
    test::soft_organ;

constexpr double dt = 0.1;

/// Nothing but springs acts on it.
model::Model undragged() {
  model::Model model = soft_organ();
  for (model::Node& n : model.nodes)
    n.drag = 0;
  return model;
}

Vec3 at(const std::vector<double>& values, std::size_t node) {
  return {values[3 * node], values[3 * node + 1], values[3 * node + 2]};
}

/// The node of a model at each place.
std::map<std::array<double, 3>, std::uint32_t> by_place(const model::Model& model) {
  std::map<std::array<double, 3>, std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    const Vec3& p = model.nodes[i].position;
    nodes[{p.x, p.y, p.z}] = i;
  }
  return nodes;
}

/// Mass times velocity of an object, were its nodes as fast as those of `whole` (mm/s, 3 n).
Vec3 momentum(const model::Model& part, const model::Model& whole,
              const std::vector<double>& velocity) {
  const auto nodes = by_place(whole);
  Vec3 sum;
  for (const model::Node& n : part.nodes)
    sum += n.mass * at(velocity, nodes.at({n.position.x, n.position.y, n.position.z}));
  return sum;
}

/// That which an object has on which nothing acts, from the way that it takes in a short time.
Vec3 momentum(scene::Simulation& s, std::size_t object, double time = 0.01) {
  const auto moment = [&] {
    Vec3 sum;
    const std::vector<double> u = shape(s, object);
    for (std::size_t i = 0; i < u.size() / 3; ++i)
      sum += s.model(object).nodes[i].mass * at(u, i);
    return sum;
  };
  s.step(0);
  const Vec3 before = moment();
  s.step(time);
  return (moment() - before) / time;
}

std::vector<double> shape_under(const model::Model& model, const contact::Load& load) {
  statics::Elastostatic solver(model, {}, one_thread());
  solver.update(load);
  return {solver.displacement().begin(), solver.displacement().end()};
}

std::vector<double> rate(const std::vector<double>& now, const std::vector<double>& before) {
  std::vector<double> v(now.size());
  for (std::size_t i = 0; i < v.size(); ++i)
    v[i] = (now[i] - before[i]) / dt;
  return v;
}

/// Nodes of the lobe, away from the incision.
std::vector<std::uint32_t> pulled_nodes(const model::Model& model) {
  std::vector<std::uint32_t> nodes;
  for (const std::uint32_t i : free_nodes(model))
    if (model.nodes[i].position.z > 44 && model.nodes[i].position.x > 104)
      nodes.push_back(i);
  return nodes;
}

const Vec3 pull{3, 1, 7};

/// Pulled k times as hard for a step.
void pull_for_a_step(scene::Simulation& s, const std::vector<std::uint32_t>& nodes, double k) {
  s.apply(scene::SetForce{0, nodes, k * pull});
  s.step(dt);
}

void let_go_and_cut(scene::Simulation& s, const std::vector<std::uint32_t>& nodes) {
  s.apply(scene::SetGravity{{}});
  s.apply(scene::Release{0, nodes});
  s.apply(lobe_off());
}

void expect_same(const Vec3& is, const Vec3& should, double tolerance) {
  EXPECT_LT(norm(is - should), tolerance * norm(should));
}

TEST(SimulationMomentum, APartIsAsFastAsItsLoadGrew) {
  const model::Model model = undragged();
  const std::vector<std::uint32_t> nodes = pulled_nodes(model);
  ASSERT_GT(nodes.size(), 2U);
  contact::Load load{};
  for (const std::uint32_t i : nodes)
    load.force[i] = pull;
  const std::vector<double> each = shape_under(model, load);
  const std::vector<double> rest(each.size());
  for (const bool in_a_step : {false, true})
    for (const bool looked_at : {false, true}) {
      scene::SimulationOptions how;
      how.shapes = looked_at;
      how.guard = looked_at;
      scene::Simulation s(one_thread(), how);
      s.add_object("organ", model, scene::Method::ffe);
      for (const double k : {1., 2., 3.})
        pull_for_a_step(s, nodes, k);
      if (in_a_step) {
        s.schedule(s.time() + dt / 2, scene::Release{0, nodes});
        s.schedule(s.time() + dt / 2, lobe_off());
        s.step(dt);
      } else {
        let_go_and_cut(s, nodes);
      }
      ASSERT_EQ(s.object_count(), 2U);
      const Vec3 should = momentum(s.model(1), model, rate(each, rest));
      EXPECT_GT(norm(should), 0);
      expect_same(momentum(s, 1), should, 1e-8);
    }
}

TEST(SimulationMomentum, WhatStandsStillHasNone) {
  for (const bool first : {true, false}) { // its first step is no motion
    scene::Simulation s(one_thread(), {});
    s.add_object("organ", undragged(), scene::Method::ffe);
    const std::vector<std::uint32_t> nodes = pulled_nodes(s.model(0));
    pull_for_a_step(s, nodes, 1);
    if (!first) {
      pull_for_a_step(s, nodes, 1.5);
      s.step(dt);
    }
    s.apply(lobe_off());
    ASSERT_EQ(s.object_count(), 2U);
    EXPECT_EQ(s.state().kinetic_energy, 0);
  }
}

TEST(SimulationMomentum, AStepWithoutTimeTakesThePlaceOfTheOneBefore) {
  const model::Model model = undragged();
  const std::vector<std::uint32_t> nodes = pulled_nodes(model);
  contact::Load load{};
  for (const std::uint32_t i : nodes)
    load.force[i] = 1.5 * pull;
  scene::Simulation s(one_thread(), {});
  s.add_object("organ", model, scene::Method::ffe);
  for (const double k : {1., 2.})
    pull_for_a_step(s, nodes, k);
  s.apply(scene::SetForce{0, nodes, 2.5 * pull});
  s.step(0);
  let_go_and_cut(s, nodes);
  ASSERT_EQ(s.object_count(), 2U);
  const std::vector<double> u = shape_under(model, load);
  expect_same(momentum(s, 1), momentum(s.model(1), model, rate(u, std::vector<double>(u.size()))),
              1e-8);
}

TEST(SimulationMomentum, AWoundThatHasJustOpenedIsNoMotion) {
  scene::Simulation s(one_thread(), {});
  s.add_object("organ", undragged(), scene::Method::ffe);
  const std::vector<std::uint32_t> nodes = pulled_nodes(s.model(0));
  s.apply(scene::SetGravity{{0, -9810, 0}});
  for (const double k : {1., 2.})
    pull_for_a_step(s, nodes, k);
  const std::vector<double> before = shape(s, 0);
  scene::SpringsToCut inside; // of one side, so that no node is doubled
  for (std::uint32_t i = 0; i < s.model(0).nodes.size(); ++i)
    if (i >= model::surface_count(s.model(0)))
      inside.to.push_back(i);
    else if (s.model(0).nodes[i].position.y < -50)
      inside.from.push_back(i);
  s.apply(scene::CutObject{0, inside});
  EXPECT_GT(s.news().cuttings[0].springs, 10U);
  EXPECT_EQ(s.news().cuttings[0].doubled, 0U);
  pull_for_a_step(s, nodes, 3);
  ASSERT_EQ(s.object_count(), 1U);
  const model::Model opened = s.model(0);
  const std::vector<double> shown = shape(s, 0);
  contact::Load load{};
  for (const std::uint32_t i : nodes)
    load.force[i] = pull;
  const std::vector<double> grown = shape_under(opened, load);
  let_go_and_cut(s, nodes);
  ASSERT_EQ(s.object_count(), 2U);
  const std::vector<double> rest(grown.size());
  const Vec3 should = momentum(s.model(1), opened, rate(grown, rest));
  const Vec3 naive = momentum(s.model(1), opened, rate(shown, before));
  EXPECT_GT(norm(naive - should), 0.01 * norm(should)); // it does matter
  expect_same(momentum(s, 1), should, 1e-8);
}

TEST(SimulationMomentum, WhatAnInstrumentPushesMovesWithIt) {
  const model::Model model = undragged();
  scene::Simulation s(one_thread(), {});
  s.add_object("organ", model, scene::Method::ffe);
  constexpr std::size_t tool = 0;
  s.apply(scene::SetInstrument{tool, {8, {}, 0}, {{100.3, -49.8, 59}, {}}});
  s.apply(scene::MoveInstrument{tool, {101, -49.5, 55}, {}, 4 * dt});
  s.step(dt);
  s.step(dt);
  const std::vector<double> before = shape(s, 0);
  s.step(dt);
  const std::vector<double> now = shape(s, 0);
  EXPECT_GT(s.instrument(tool).nodes, 0U);
  s.apply(scene::Withdraw{tool});
  s.apply(lobe_off());
  ASSERT_EQ(s.object_count(), 2U);
  const Vec3 should = momentum(s.model(1), model, rate(now, before));
  EXPECT_GT(norm(should), 0);
  expect_same(momentum(s, 1), should, 1e-6);
}

TEST(SimulationMomentum, AStepThatFailsAndIsRepeatedGivesTheSame) {
  bool fail = true;
  scene::SimulationOptions how, calm_how;
  how.guard = calm_how.guard = true;
  how.applied = [&](const scene::Change& change) {
    if (fail && std::holds_alternative<scene::CutObject>(change))
      throw Error("not now");
  };
  scene::Simulation s(one_thread(), how), calm(one_thread(), calm_how);
  for (scene::Simulation* one : {&s, &calm}) {
    one->add_object("organ", undragged(), scene::Method::ffe);
    const std::vector<std::uint32_t> nodes = pulled_nodes(one->model(0));
    for (const double k : {1., 2.})
      pull_for_a_step(*one, nodes, k);
  }
  // One that is taken back behind what is shown: the step before must be there again.
  const std::vector<std::uint32_t> nodes = pulled_nodes(s.model(0));
  for (scene::Simulation* one : {&s, &calm}) {
    one->schedule(one->time() + dt / 2, scene::SetForce{0, nodes, 5 * pull});
    one->schedule(one->time() + dt / 2, lobe_off());
  }
  EXPECT_THROW(s.step(dt), Error);
  EXPECT_EQ(s.object_count(), 1U);
  fail = false;
  for (int k = 0; k < 3; ++k) {
    for (scene::Simulation* one : {&s, &calm})
      one->step(dt);
    ASSERT_EQ(s.object_count(), 2U);
    ASSERT_EQ(calm.object_count(), 2U);
    for (const std::size_t object : {0U, 1U})
      EXPECT_EQ(shape(s, object), shape(calm, object));
    EXPECT_EQ(s.state().kinetic_energy, calm.state().kinetic_energy);
    EXPECT_GT(s.state().kinetic_energy, 0);
  }
}

TEST(SimulationMomentum, AStepTakenBackBehindItsShapesLeavesTheOneBefore) {
  std::array<Vec3, 2> found;
  for (const bool disturbed : {false, true}) {
    scene::SimulationOptions how;
    how.guard = true;
    scene::Simulation s(one_thread(), how);
    s.add_object("organ", undragged(), scene::Method::ffe);
    bool missing = disturbed;
    scene::ObjectSource late{.model = [&] {
      if (missing)
        throw Error("not now");
      return test::shell();
    }};
    s.add_object("other", late, scene::Method::ffe);
    const std::vector<std::uint32_t> nodes = pulled_nodes(s.model(0));
    for (const double k : {1., 2.})
      pull_for_a_step(s, nodes, k);
    if (disturbed) {
      s.apply(scene::SetForce{0, nodes, 9. * pull});
      s.apply(scene::SetForce{1, {0}, {1, 0, 0}}); // shown last
      EXPECT_THROW(s.step(dt), Error);
      s.apply(scene::Release{1, {0}});
      missing = false;
    }
    let_go_and_cut(s, nodes);
    ASSERT_EQ(s.object_count(), 3U);
    found[disturbed ? 1 : 0] = momentum(s, 2);
  }
  EXPECT_GT(norm(found[0]), 0);
  expect_same(found[1], found[0], 1e-9);
}

TEST(SimulationMomentum, WhatHangsLooselyIsAsFastAsItsShape) {
  const model::Model model = test::shell();
  const std::uint32_t top = highest(model);
  const std::vector<double> u = shape_under(model, {.gravity = {0, 0, -1}});
  double energy = 0;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (model.nodes[i].fixed == model::fixed_none)
      energy += model.nodes[i].mass / 2 * dot(at(u, i), at(u, i)) / (dt * dt);
  for (const bool moving : {true, false})
    for (const bool disturbed : {false, true}) {
      bool fail = disturbed;
      scene::SimulationOptions how;
      how.guard = true;
      how.applied = [&](const scene::Change& change) {
        if (fail && std::holds_alternative<scene::CutObject>(change))
          throw Error("not now");
      };
      scene::Simulation s(one_thread(), how);
      s.add_object("ball", model, scene::Method::ffe);
      for (const double k : {1., 2.}) {
        s.apply(scene::SetGravity{{0, 0, -k}});
        s.step(dt);
      }
      if (!moving)
        s.step(dt);
      s.schedule(s.time() + dt / 2, scene::CutObject{0, test::all_but_one(model, top)});
      if (disturbed) {
        EXPECT_THROW(s.step(dt), Error);
      }
      fail = false;
      s.step(dt);
      ASSERT_EQ(test::count(s, scene::Cutting::Kind::loose), 1U);
      ASSERT_EQ(s.object(0).method, scene::Method::ela);
      const double should = moving ? energy : 0;
      EXPECT_LE(std::abs(s.state().kinetic_energy - should), 1e-8 * should);
    }
}

/// Stiffnesses of its own, whatever exp2ela's defaults are: the lobe hangs on soft springs, so that
/// it tears off as one, with what holds it.
model::Model soft_below_the_lobe() {
  model::Model model = undragged();
  for (model::Spring& spring : model.springs) {
    const bool crosses =
        (model.nodes[spring.i].position.z > 41) != (model.nodes[spring.j].position.z > 41);
    spring.stiffness = crosses ? 5 : 1000;
  }
  return model;
}

TEST(SimulationMomentum, WhatTearsOffGoesOnWithTheStepThatToreIt) {
  const model::Model model = soft_below_the_lobe();
  scene::Simulation s(one_thread(), {});
  s.add_object("organ", model, scene::Method::ffe);
  std::vector<std::uint32_t> lobe, cut;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    if (model.nodes[i].position.z > 41)
      lobe.push_back(i);
    if (model.nodes[i].position.x < 112 || i >= model::surface_count(model))
      cut.push_back(i); // all but a bridge
  }
  const auto pulled = [&](int k) {
    s.apply(scene::SetDisplacement{0, lobe, {0, 0, 1. * k}});
    s.step(dt);
  };
  pulled(1);
  scene::CutObject max = lobe_off();
  std::get<scene::PlaneToCut>(max.what).nodes = cut;
  s.apply(max);
  ASSERT_EQ(s.object_count(), 1U);
  for (std::uint32_t& node : lobe)
    node = s.object(0).places[node];
  s.apply(scene::SetTear{0, 0.4});
  for (int k = 2; k < 20 && s.object_count() == 1; ++k)
    pulled(k);
  const std::size_t parts = s.object_count();
  ASSERT_GT(parts, 1U);
  for (std::size_t part = 1; part < parts; ++part) {
    std::vector<std::uint32_t> all(s.model(part).nodes.size());
    std::iota(all.begin(), all.end(), 0U);
    s.apply(scene::Release{part, all});
    s.apply(scene::SetTear{part, 0});
  }
  for (std::size_t part = 1; part < parts; ++part) {
    const Vec3 is = momentum(s, part) / model::total_mass(s.model(part));
    EXPECT_GT(is.z, 0.3 / dt); // a third of its nodes was held, or more
    EXPECT_LT(is.z, 1.0001 / dt);
  }
}

} // namespace
} // namespace gewebe::test
