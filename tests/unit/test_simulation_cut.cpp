// Scenes in which objects are cut: what is kept, what comes off, what is taken back.

#include "base/error.h"
#include "larger.h"
#include "simulation_scenes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using test::count, test::highest, test::incision, test::lobe_off, test::one_thread, test::shape,
    test::soft_organ, test::free_nodes, test::organ;

TEST(SimulationCut, AnElastostaticShapeIsThatOfTheCutModel) {
  scene::Simulation s(one_thread(), {});
  s.add_object("organ", organ(3), scene::Method::ffe);
  const std::uint32_t node = free_nodes(s.model(0))[20];
  s.apply(scene::SetForce{0, {node}, {0, 40, 25}});
  s.apply(scene::SetDisplacement{0, {highest(s.model(0))}, {0, 0, 0.5}});
  s.step(0.1);
  const std::vector<double> before = shape(s, 0);
  s.apply(scene::CutObject{0, incision(s.model(0))});
  ASSERT_EQ(count(s, scene::Cutting::Kind::cut), 1U);
  EXPECT_GT(s.news().cuttings[0].doubled, 2U);
  s.step(0.1);
  EXPECT_EQ(count(s, scene::Cutting::Kind::loose), 0U);
  const std::vector<double> after = shape(s, 0);
  ASSERT_EQ(after.size(), 3 * s.model(0).nodes.size());
  // Afresh.
  contact::Load load{};
  const model::Model& model = s.model(0);
  const std::span<const std::uint32_t> first = s.object(0).first_nodes;
  std::vector<double> mass(s.first_model(0).nodes.size());
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    if (first[i] == node)
      load.force[i] = model.nodes[i].mass / s.first_model(0).nodes[node].mass * Vec3{0, 40, 25};
    if (first[i] == highest(s.first_model(0)))
      load.displacement[i] = {0, 0, 0.5};
  }
  statics::Elastostatic fresh(model, {}, one_thread());
  fresh.update(load);
  const std::span<const double> want = fresh.displacement();
  double largest = 0, worst = 0, opened = 0;
  for (std::size_t i = 0; i < want.size(); ++i) {
    largest = test::larger(largest, std::abs(want[i]));
    worst = test::larger(worst, std::abs(want[i] - after[i]));
  }
  EXPECT_LT(worst, 1e-8 * largest);
  for (std::size_t i = 0; i < before.size() && i < 3 * model::surface_count(s.first_model(0)); ++i)
    opened = test::larger(opened, std::abs(before[i] - after[i]));
  EXPECT_GT(opened, 1e-4 * largest); // it does matter
}

TEST(SimulationCut, NothingMovesWhereNothingIsSeveredThatCarries) {
  // A closed wound answers as before: copies that are displaced alike.
  scene::Simulation s(one_thread(), {});
  s.add_object("organ", organ(2, false), scene::Method::ffe);
  const scene::PlaneToCut cut = incision(s.model(0));
  std::vector<std::uint32_t> near;
  for (const auto& [i, j] : cutting::plane_cut(s.model(0), cut.plane, *cut.nodes).edges)
    near.insert(near.end(), {i, j});
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  std::erase_if(near,
                [&](std::uint32_t i) { return s.model(0).nodes[i].fixed != model::fixed_none; });
  s.apply(scene::SetDisplacement{0, near, {0.1, 0.2, 0.3}});
  s.step(0.1);
  const std::vector<double> before = shape(s, 0);
  const std::size_t centrals = s.model(0).nodes.size() - model::surface_count(s.model(0));
  s.apply(scene::CutObject{0, cut});
  s.step(0.1);
  const std::vector<double> after = shape(s, 0);
  // Central springs that the plane severs count, so only where there are none.
  EXPECT_GT(centrals, 0U);
  for (const std::uint32_t node : near)
    for (std::size_t a = 0; a < 3; ++a)
      EXPECT_EQ(after[3 * std::size_t{node} + a], before[3 * std::size_t{node} + a]);
  for (std::uint32_t i = 0; i < s.object(0).first_nodes.size(); ++i)
    if (i >= model::surface_count(s.first_model(0)) && i < model::surface_count(s.model(0))) {
      for (std::size_t a = 0; a < 3; ++a)
        EXPECT_EQ(after[3 * std::size_t{i} + a],
                  before[3 * std::size_t{s.object(0).first_nodes[i]} + a]);
    }
}

TEST(SimulationCut, ALobeComesOffAndFalls) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), {});
    s.add_object("organ", soft_organ(), method);
    s.apply(scene::SetGravity{{0, 0, -9810}});
    s.step(0.02);
    const double mass = model::total_mass(s.model(0));
    s.schedule(0.03, lobe_off());
    s.step(0.02);
    ASSERT_EQ(s.object_count(), 2U);
    EXPECT_EQ(s.object(1).name, "organ.1");
    EXPECT_EQ(s.object(1).method, scene::Method::ela);
    EXPECT_EQ(count(s, scene::Cutting::Kind::cut), 1U);
    EXPECT_EQ(count(s, scene::Cutting::Kind::part), 1U);
    EXPECT_NEAR(model::total_mass(s.model(0)) + model::total_mass(s.model(1)), mass, 1e-12 * mass);
    s.take_news();
    const auto height = [&] {
      const std::vector<double> u = shape(s, 1);
      double sum = 0;
      for (std::size_t i = 0; i < u.size(); i += 3)
        sum += u[i + 2];
      return 3 * sum / static_cast<double>(u.size());
    };
    const double start = height();
    s.step(0.1);
    // It falls freely, drag aside.
    EXPECT_LT(height() - start, -0.7 * 9810 * 0.1 * 0.1 / 2);
    EXPECT_GT(height() - start, -1.5 * 9810 * (0.11 * 0.11) / 2);
    for (const std::size_t object : {0U, 1U})
      for (const double u : shape(s, object))
        ASSERT_TRUE(std::isfinite(u));
  }
}

TEST(SimulationCut, APartGoesOnWithItsMomentum) {
  scene::Simulation s(one_thread(), {});
  model::Model model = organ(3);
  for (model::Node& n : model.nodes) {
    n.fixed = model::fixed_none;
    n.drag = 0;
  }
  s.add_object("organ", model, scene::Method::ela);
  s.apply(scene::SetGravity{{100, 0, 0}});
  s.step(0.5);
  s.apply(scene::SetGravity{{}});
  s.apply(lobe_off());
  ASSERT_EQ(s.object_count(), 2U);
  const auto middle = [&](std::size_t object) {
    Vec3 sum;
    double mass = 0;
    const std::vector<double> u = shape(s, object);
    for (std::size_t i = 0; i < u.size() / 3; ++i) {
      const double m = s.model(object).nodes[i].mass;
      sum += m * Vec3{u[3 * i], u[3 * i + 1], u[3 * i + 2]};
      mass += m;
    }
    return sum / mass;
  };
  s.step(0);
  const Vec3 first = middle(0), part = middle(1);
  s.step(0.2);
  // 50 mm/s each.
  EXPECT_NEAR((middle(0) - first).x, 10, 1e-6);
  EXPECT_NEAR((middle(1) - part).x, 10, 1e-6);
}

TEST(SimulationCut, LoadsGripsAndEventsFollowTheirNodes) {
  scene::Simulation s(one_thread(), {});
  s.add_object("organ", soft_organ(), scene::Method::ela);
  const std::uint32_t top = highest(s.model(0)), low = free_nodes(s.model(0))[0];
  ASSERT_LT(s.model(0).nodes[low].position.z, 40);
  constexpr std::size_t probe = 0;
  s.apply(scene::SetInstrument{probe, {1, {}, 0}, {{100, -50, 80}, {}}});
  s.apply(scene::Grasp{0, {top}, probe});
  s.apply(scene::SetForce{0, {low}, {5, 0, 0}});
  s.schedule(0.05, scene::Release{0, {low, top}});
  s.step(0.01);
  s.apply(lobe_off());
  s.step(0.01);
  ASSERT_EQ(s.object_count(), 2U);
  EXPECT_EQ(s.contact_forces(0).size(), 0U);
  EXPECT_EQ(s.contact_forces(1).size(), 1U); // the probe holds the lobe
  EXPECT_EQ(s.instrument(probe).nodes, 1U);
  EXPECT_EQ(s.pending(), 2U); // one for each object
  s.apply(scene::MoveInstrument{probe, {100, -50, 90}, {}, 0});
  s.step(0.01);
  const std::uint32_t held = s.contact_forces(1)[0].node;
  EXPECT_NEAR(shape(s, 1)[3 * held + 2], 10, 1e-9);
  s.step(0.05);
  EXPECT_EQ(s.contact_forces(1).size(), 0U);
  EXPECT_EQ(s.pending(), 0U);
}

TEST(SimulationCut, AnEventThatCutsKeepsItsOwnNodes) {
  // Every time it takes the springs of a band; what is behind the copies is numbered anew.
  scene::Simulation s(one_thread(), {});
  s.add_object("organ", soft_organ(), scene::Method::ela);
  const std::size_t surface = model::surface_count(s.model(0)), nodes = s.model(0).nodes.size();
  std::vector<std::uint32_t> centrals;
  for (std::size_t i = surface; i < nodes; ++i)
    centrals.push_back(static_cast<std::uint32_t>(i));
  s.schedule(s.time(), scene::CutObject{0, incision(s.model(0))}, 0.01);
  s.schedule(s.time(), scene::SetForce{0, centrals, {1, 0, 0}}, 0.01);
  s.step(0.01);
  ASSERT_GT(s.model(0).nodes.size(), nodes); // copies came between
  s.apply(scene::Release{0, free_nodes(s.model(0))});
  EXPECT_THROW(s.step(0.01), Error); // it is open already
  // The force that follows it is on the centrals, wherever they are.
  for (std::uint32_t i = 0; i < s.model(0).nodes.size(); ++i) {
    const bool central = i >= model::surface_count(s.model(0));
    EXPECT_EQ(central, s.object(0).first_nodes[i] >= surface) << i;
  }
}

TEST(SimulationCut, AnEventInFlightIsFollowedIntoWhatComesOff) {
  scene::Simulation s(one_thread(), {});
  s.add_object("organ", soft_organ(), scene::Method::ela);
  std::vector<std::uint32_t> all(s.model(0).nodes.size());
  for (std::uint32_t i = 0; i < all.size(); ++i)
    all[i] = i;
  scene::CutObject cut = lobe_off();
  std::get<scene::PlaneToCut>(cut.what).nodes = all;
  s.schedule(s.time(), cut, 0.01);
  s.step(0.01);
  ASSERT_EQ(s.object_count(), 2U);
  // It comes again, with nodes that there are: the plane has nothing to part any more.
  try {
    s.step(0.01);
    FAIL() << "cut again";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("of these nodes"), std::string::npos) << error.what();
  }
}

TEST(SimulationCut, WhatHangsLooselyGoesOnElastodynamic) {
  const model::Model model = test::shell();
  std::vector<std::string> warnings;
  scene::SimulationOptions how;
  how.warn = [&](const std::string& text) { warnings.push_back(text); };
  how.guard = true;
  scene::Simulation s(one_thread(), how);
  s.add_object("organ", model, scene::Method::ffe);
  s.apply(scene::SetGravity{{0, 0, -1}});
  s.step(0.01);
  s.apply(scene::CutObject{0, test::all_but_one(model, highest(model))});
  s.step(0.01);
  ASSERT_EQ(count(s, scene::Cutting::Kind::loose), 1U);
  EXPECT_EQ(s.object(0).method, scene::Method::ela);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("goes on elastodynamic"), std::string::npos);
  s.step(0.1);
  for (const double u : shape(s, 0))
    EXPECT_TRUE(std::isfinite(u));
}

TEST(SimulationCut, WhatHangsLooselyIsHeldByWhatDisplacesIt) {
  const model::Model model = test::shell();
  scene::Simulation s(one_thread(), {.guard = true});
  s.add_object("organ", model, scene::Method::ffe);
  s.apply(scene::SetGravity{{0, 0, -1}});
  s.step(0.01);
  s.apply(scene::CutObject{0, test::all_but_one(model, highest(model))});
  std::vector<std::uint32_t> all(model::surface_count(s.model(0)));
  for (std::uint32_t i = 0; i < all.size(); ++i)
    all[i] = i;
  std::erase_if(all,
                [&](std::uint32_t i) { return s.model(0).nodes[i].fixed != model::fixed_none; });
  s.apply(scene::SetDisplacement{0, all, {0, 0, 0.25}});
  s.step(0.01);
  EXPECT_EQ(count(s, scene::Cutting::Kind::loose), 0U);
  EXPECT_EQ(s.object(0).method, scene::Method::ffe);
  for (const std::uint32_t node : all)
    EXPECT_EQ(shape(s, 0)[3 * node + 2], 0.25);
  s.apply(scene::Release{0, all});
  s.step(0.01);
  EXPECT_EQ(count(s, scene::Cutting::Kind::loose), 1U);
  EXPECT_EQ(s.object(0).method, scene::Method::ela);
}

TEST(SimulationCut, RestoreMakesItWholeAgain) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), {}), never(one_thread(), {});
    for (scene::Simulation* one : {&s, &never}) {
      one->add_object("organ", organ(3), method);
      one->apply(scene::SetForce{0, {free_nodes(one->model(0))[20]}, {0, 10, 5}});
      one->step(0.01);
    }
    s.apply(scene::CutObject{0, incision(s.model(0))});
    s.step(0.01);
    s.apply(scene::Restore{0});
    EXPECT_EQ(s.model(0), never.model(0));
    s.step(30);
    never.step(30.01);
    const std::vector<double> a = shape(s, 0), b = shape(never, 0);
    double largest = 0;
    for (const double value : b)
      largest = test::larger(largest, std::abs(value));
    for (std::size_t i = 0; i < a.size(); ++i)
      ASSERT_NEAR(a[i], b[i], 1e-6 * largest);
    EXPECT_THROW(s.apply(scene::Restore{0}), Error);
  }
}

TEST(SimulationCut, BadCutsAreRefusedAndChangeNothing) {
  scene::SimulationOptions how;
  how.guard = true;
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), how);
    s.add_object("organ", organ(2), method);
    s.apply(scene::SetForce{0, {free_nodes(s.model(0))[3]}, {0, 1, 5}});
    s.step(0.01);
    const model::Model before = s.model(0);
    const std::vector<double> u = shape(s, 0);
    std::uint32_t fixed = 0;
    while (before.nodes[fixed].fixed == model::fixed_none)
      ++fixed;
    std::vector<std::uint32_t> all(before.nodes.size());
    for (std::uint32_t i = 0; i < all.size(); ++i)
      all[i] = i;
    const scene::CutObject bad[]{
        {0, scene::PlaneToCut{{{0, 0, 500}, {0, 0, 1}}, {}}},
        {0, scene::PlaneToCut{{{100, -50, 30}, {0, 0, 1}}, std::vector<std::uint32_t>{fixed}}},
        {0, scene::SpringsToCut{{0}, {0}}},
        {0, scene::SpringsToCut{{fixed}, all}},
    };
    for (const scene::CutObject& cut : bad) {
      try {
        s.apply(cut);
        ADD_FAILURE() << "no error";
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("organ"), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find("expected"), std::string::npos) << error.what();
      }
      EXPECT_EQ(s.model(0), before);
    }
    EXPECT_TRUE(s.news().cuttings.empty());
    EXPECT_EQ(shape(s, 0), u);
    s.apply(scene::CutObject{0, incision(s.model(0))});
    EXPECT_THROW(s.apply(scene::CutObject{0, incision(before)}), Error); // nothing is left
    EXPECT_EQ(s.news().cuttings.size(), 1U);
  }
}

TEST(SimulationCut, AStepThatFailsTakesACutBack) {
  scene::SimulationOptions how;
  how.guard = true;
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), how), calm(one_thread(), how);
    for (scene::Simulation* one : {&s, &calm}) {
      one->add_object("organ", soft_organ(), method);
      one->add_object("other", organ(1), scene::Method::ela);
      one->apply(scene::SetForce{0, {highest(one->model(0))}, {0, 10, 5}});
      one->apply(scene::SetGravity{{0, 0, -100}});
      one->step(0.01);
    }
    const model::Model before = s.model(0);
    constexpr std::size_t probe = 0;
    for (scene::Simulation* one : {&s, &calm})
      one->apply(scene::SetInstrument{probe, {1, {}, 0}, {{100, -50, 90}, {}}});
    s.apply(scene::Grasp{0, {highest(before)}, probe});
    calm.apply(scene::Grasp{0, {highest(before)}, probe});
    s.schedule(0.015, lobe_off());
    s.schedule(0.018,
               scene::CutObject{1, scene::PlaneToCut{{{0, 0, 500}, {0, 0, 1}}, {}}}); // misses
    EXPECT_THROW(s.step(0.01), Error);
    EXPECT_EQ(s.object_count(), 2U);
    EXPECT_EQ(s.model(0), before);
    EXPECT_EQ(s.time(), 0.01);
    EXPECT_EQ(s.pending(), 2U);
    EXPECT_TRUE(s.news().cuttings.empty());
    EXPECT_EQ(shape(s, 0), shape(calm, 0));
    // Up to the cut it goes on as if nothing had been.
    s.step_to(0.014);
    calm.step_to(0.014);
    EXPECT_EQ(shape(s, 0), shape(calm, 0));
    EXPECT_EQ(s.contact_forces(0), calm.contact_forces(0));
  }
}

TEST(SimulationCut, ABladeCutsWhatItSweepsOver) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela})
    for (const int steps : {1, 50}) {
      scene::Simulation s(one_thread(), {});
      s.add_object("organ", organ(4), method);
      s.apply(scene::SetForce{0, {highest(s.model(0))}, {0, 1, 5}});
      constexpr std::size_t blade = 0;
      contact::InstrumentShape edge;
      edge.radius = 0;
      edge.blade = true;
      edge.axis = {0, 0, -8};
      s.apply(scene::SetInstrument{blade, edge, {{88, -50.3, 53}, {}}});
      s.step(0);
      s.apply(scene::MoveInstrument{blade, {112, -50.3, 53}, {}, 1});
      for (int k = 0; k < steps; ++k)
        s.step(1.0 / steps);
      EXPECT_GE(count(s, scene::Cutting::Kind::cut), 1U);
      std::size_t doubled = 0;
      for (const scene::Cutting& c : s.news().cuttings)
        doubled += c.doubled;
      EXPECT_GT(doubled, 8U) << steps;
      EXPECT_EQ(s.instrument(blade).nodes, 0U);
      EXPECT_THROW(s.apply(scene::Grasp{0, {free_nodes(s.model(0))[2]}, blade}), Error);
    }
}

TEST(SimulationCut, StretchedTissueTears) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    scene::Simulation s(one_thread(), {});
    model::BuildOptions options;
    options.centrals = 0;
    options.bend = true;
    model::Model model = model::build_model(test::sheet(8, 4), options, Context{}).model;
    for (model::Node& n : model.nodes)
      n.fixed = n.position.x < 0.5 ? model::fixed_all : model::fixed_z;
    std::vector<std::uint32_t> right;
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      if (model.nodes[i].position.x > 7.5)
        right.push_back(i);
    s.add_object("sheet", model, method);
    s.apply(scene::SetTear{0, 0.3});
    for (int k = 1; k <= 40; ++k) {
      s.apply(scene::SetDisplacement{0, right, {0.12 * k, 0, 0}});
      s.step(0.05);
      for (std::size_t object = 0; object < s.object_count(); ++object)
        for (const double u : shape(s, object))
          ASSERT_TRUE(std::isfinite(u));
    }
    EXPECT_GT(count(s, scene::Cutting::Kind::cut), 0U);
  }
}

TEST(SimulationCut, TheSameForAnyNumberOfThreads) {
  std::vector<double> first;
  for (const int threads : {1, 2}) {
    Context context;
    context.threads = threads;
    scene::Simulation s(context, {});
    s.add_object("organ", soft_organ(), scene::Method::ffe);
    s.apply(scene::SetGravity{{0, 0, -9810}});
    s.step(0.01);
    s.apply(scene::CutObject{0, incision(s.model(0))});
    s.step(0.01);
    s.apply(lobe_off());
    s.step(0.05);
    std::vector<double> all = shape(s, 0);
    const std::vector<double> part = shape(s, 1);
    all.insert(all.end(), part.begin(), part.end());
    if (threads == 1)
      first = all;
    else
      EXPECT_EQ(all, first);
  }
}

TEST(SimulationCut, WhatIsTiedStaysTied) {
  scene::Simulation s(one_thread(), {});
  s.add_object("organ", soft_organ(), scene::Method::ela);
  s.add_object("weight", test::two_masses(), scene::Method::ela);
  const std::uint32_t top = highest(s.model(0));
  s.apply(scene::Attach{0, {top}, 1, {0}, 1e4});
  s.apply(scene::SetGravity{{0, 0, -1000}});
  s.step(0.01);
  s.apply(lobe_off());
  s.step(0.3);
  ASSERT_EQ(s.object_count(), 3U);
  // The lobe and what is tied to it fall together.
  const double lobe = shape(s, 2)[2], weight = shape(s, 1)[2];
  EXPECT_LT(lobe, -20);
  EXPECT_NEAR(lobe, weight, 10);
  EXPECT_THROW(s.apply(scene::SetMethod{1, scene::Method::ffe}), Error);
}

/// The copy that keeps the number of the node keeps its tie.
TEST(SimulationCut, ATieFollowsTheMainCopyOfADoubledNode) {
  const model::Model organ = soft_organ();
  scene::Simulation cut(one_thread(), {});
  cut.add_object("organ", organ, scene::Method::ela);
  cut.apply(scene::CutObject{0, incision(organ)});
  ASSERT_EQ(cut.object_count(), 1U);
  const auto [mothers, places] = [&] {
    const scene::ObjectFacts facts = cut.object(0);
    return std::pair(std::vector<std::uint32_t>(facts.first_nodes.begin(), facts.first_nodes.end()),
                     std::vector<std::uint32_t>(facts.places.begin(), facts.places.end()));
  }();
  std::size_t doubled = 0;
  for (std::uint32_t copy = 0; copy < mothers.size(); ++copy) {
    const std::uint32_t node = mothers[copy], main = places.empty() ? node : places[node];
    if (copy == main || doubled == 3)
      continue;
    ++doubled;
    for (const bool other : {false, true}) {
      scene::Simulation s(one_thread(), {});
      s.add_object("organ", organ, scene::Method::ela);
      s.add_object("weight", test::two_masses(1), scene::Method::ela);
      if (other)
        s.apply(scene::Attach{1, {0}, 0, {node}, 2000});
      else
        s.apply(scene::Attach{0, {node}, 1, {0}, 2000});
      s.apply(scene::CutObject{0, incision(organ)});
      s.apply(scene::SetForce{1, {0}, {0, 0, 3000}});
      s.step(0.03);
      const std::vector<double> u = shape(s, 0);
      EXPECT_GT(u[3 * std::size_t{main} + 2], 2 * std::abs(u[3 * std::size_t{copy} + 2])) << node;
      EXPECT_GT(u[3 * std::size_t{main} + 2], 1e-3);
    }
  }
  EXPECT_GT(doubled, 0U);
}

TEST(SimulationCut, AShapeThatNobodyAskedForIsThereWhenSomebodyDoes) {
  // Grasped between a cut and the next step, with the shape emitted before or not.
  const auto run = [](bool emitted) {
    scene::Simulation s(one_thread(), {});
    s.add_object("organ", organ(3), scene::Method::ffe);
    const std::uint32_t top = highest(s.model(0));
    s.apply(scene::SetDisplacement{0, {top}, {0, 0, 0.5}});
    if (emitted)
      s.apply(scene::Emit{.forces = false, .instruments = false});
    s.step(0.1);
    s.apply(scene::CutObject{0, incision(s.model(0))});
    scene::CutObject more{0, incision(s.model(0))};
    std::get<scene::PlaneToCut>(more.what).plane.point.x += 4;
    s.apply(more); // two in a row
    constexpr std::size_t tool = 0;
    contact::InstrumentShape sphere;
    sphere.radius = 1;
    s.apply(scene::SetInstrument{tool, sphere, {{200, 200, 200}, {}}});
    s.apply(scene::Grasp{0, {free_nodes(s.model(0))[20], free_nodes(s.model(0))[60]}, tool});
    s.step(0.1);
    return shape(s, 0);
  };
  const std::vector<double> early = run(true), late = run(false);
  ASSERT_EQ(early.size(), late.size());
  double largest = 0;
  for (const double u : early)
    largest = test::larger(largest, std::abs(u));
  EXPECT_GT(largest, 0.4);
  for (std::size_t k = 0; k < early.size(); ++k)
    EXPECT_TRUE(std::abs(early[k] - late[k]) <= 1e-9 * largest) << k;
}

TEST(SimulationCut, ForcesDoNotDependOnShapesThatWereAskedFor) {
  const auto run = [](bool shapes) {
    scene::Simulation s(one_thread(), {});
    s.add_object("organ", organ(3), scene::Method::ffe);
    const std::vector<std::uint32_t> nodes = free_nodes(s.model(0));
    s.apply(scene::SetDisplacement{0, {nodes[10], nodes[11], nodes[40]}, {0, 0.2, 0.5}});
    std::vector<double> all;
    for (int k = 0; k < 5; ++k) {
      if (k == 1)
        s.apply(scene::CutObject{0, incision(s.model(0))});
      if (k == 3)
        s.apply(scene::SetDisplacement{0, {nodes[10]}, {0.1, 0.2, 0.5}});
      s.step(0.1);
      if (shapes)
        (void)shape(s, 0);
      for (const contact::NodeVector& f : s.contact_forces(0))
        all.insert(all.end(), {f.value.x, f.value.y, f.value.z});
    }
    return all;
  };
  const std::vector<double> with = run(true), without = run(false);
  EXPECT_EQ(with, without); // to the bit
  EXPECT_GE(with.size(), 45U);
}

TEST(SimulationCut, APreparedFirstCutIsTheSameAndFactorisesNothingBefore) {
  const auto shape = [](bool prepared) {
    scene::Simulation s(test::one_thread(), {});
    const model::Model model = test::organ(3);
    s.add_object("organ", model, scene::Method::ffe);
    s.apply(scene::SetForce{0, {test::highest(model)}, {0, 0, 2000}});
    s.step(0.001);
    if (prepared)
      s.apply(scene::Prepare{.object = 0, .contact = false, .cut = true, .nodes_ahead = {}});
    s.apply(scene::CutObject{0, test::incision(model)});
    s.step(0.001);
    EXPECT_EQ(s.counts().cuts, 1);
    EXPECT_EQ(s.counts().cut_unprepared, prepared ? 0 : 1);
    return std::vector<double>(s.displacement(0).begin(), s.displacement(0).end());
  };
  EXPECT_EQ(shape(true), shape(false));
}

} // namespace
} // namespace gewebe::test
