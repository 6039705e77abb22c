// Solids that move, as scenes have them: at rest they stand where statics says, keep their volume,
// follow what acts on them, change their method, and go back.

#include "base/context.h"
#include "base/error.h"
#include "fem/solid_model.h"
#include "fem/stress.h"
#include "fit/swing_fit.h"
#include "formats/model/ela.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "tests/unit/relative_difference.h"
#include "tet_fixtures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::one_thread, test::settle, test::shape;
using Numbers = std::vector<double>;

/// A bar 20 × 8 × 8 mm along x, held at x = 0.
model::Model bar(bool quadratic = true, double poisson = 0.45) {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, poisson}};
  options.quadratic = quadratic;
  model::Model model = fem::solid_model(test::box_tetrahedra(5, 2, 2, 4), options, {});
  for (model::Node& node : model.nodes)
    if (node.position.x == 0)
      node.fixed = model::fixed_all;
  return model;
}

std::vector<std::uint32_t> end_of(const model::Model& model) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
    if (model.nodes[i].position.x > 20 - 1e-9)
      nodes.push_back(i);
  return nodes;
}

/// Well damped.
integrator::SolidChoice damped(integrator::SolidLaw law = integrator::SolidLaw::corotational) {
  integrator::SolidChoice choice;
  choice.law = law;
  choice.damping = integrator::damping_per_stiffness(0.5, 20);
  return choice;
}

double largest(std::span<const double> values) {
  double most = 0;
  for (const double x : values)
    most = test::larger(most, std::abs(x));
  return most;
}

std::unique_ptr<scene::Simulation> scene(const model::Model& model, scene::Method method,
                                         const integrator::SolidChoice& choice,
                                         scene::SimulationOptions options = {},
                                         Context context = one_thread()) {
  auto s = std::make_unique<scene::Simulation>(context, std::move(options));
  s->add_object("o", model, method, {}, scene::Integration::semi_implicit, choice);
  return s;
}

double volume(const model::Model& model, std::span<const double> u) {
  double sum = 0;
  for (const Tetrahedron& t : model.tetrahedra) {
    std::array<Vec3, 4> p;
    for (std::size_t k = 0; k < 4; ++k)
      p[k] = model.nodes[t[k]].position + (u.empty() ? Vec3{} : vector_at(u, t[k]));
    sum += tetrahedra::tetrahedron_volume(p[0], p[1], p[2], p[3]);
  }
  return sum;
}

class MovingSolid : public testing::TestWithParam<integrator::SolidLaw> {};

TEST_P(MovingSolid, RestsWhereStaticsSaysUnderSmallLoads) {
  for (const bool quadratic : {true, false}) {
    if (GetParam() == integrator::SolidLaw::hyperelastic && quadratic)
      continue; // slow; solid_motion's own tests have it
    const model::Model model = bar(quadratic);
    const std::vector<std::uint32_t> end = end_of(model);
    const std::vector<std::pair<std::string, std::function<void(scene::Simulation&)>>> loads{
        {"weight",
         [](scene::Simulation& s) {
           s.apply(scene::SetGravity{{0.4, 0, -1}});
         }},
        {"force",
         [&](scene::Simulation& s) {
           s.apply(scene::SetForce{0, {end[0]}, {0, 2, 1}});
         }},
        {"pressure",
         [&](scene::Simulation& s) {
           s.apply(scene::SetPressure{0, end, {-1, 0}});
         }},
        {"displacement", [&](scene::Simulation& s) {
           s.apply(scene::SetGravity{{0, 0, -0.05}});
           s.apply(scene::SetDisplacement{0, {end[1], end[2]}, {0, 2e-5, 1e-4}});
         }}};
    for (const auto& [name, act] : loads) {
      SCOPED_TRACE(name + (quadratic ? " quadratic" : " linear"));
      const auto still = scene(model, scene::Method::ffe, {}),
                 moving = scene(model, scene::Method::ela, damped(GetParam()));
      act(*still);
      act(*moving);
      still->step(0.1);
      settle(*moving);
      const Numbers expected = shape(*still, 0);
      EXPECT_GT(largest(expected), 1e-6);
      EXPECT_LE(test::largest_difference(shape(*moving, 0), expected), 1e-4 * largest(expected));
      const auto &a = still->contact_forces(0), &b = moving->contact_forces(0);
      ASSERT_EQ(a.size(), name == "displacement" ? 2U : 0U);
      ASSERT_EQ(b.size(), a.size());
      for (std::size_t k = 0; k < a.size(); ++k) {
        EXPECT_EQ(a[k].node, b[k].node);
        EXPECT_LE(norm(a[k].value - b[k].value), 1e-4 * norm(a[k].value));
      }
    }
  }
}

TEST_P(MovingSolid, KeepsItsVolumeUnderItsWeight) {
  const bool quadratic = GetParam() == integrator::SolidLaw::corotational;
  const model::Model model = bar(quadratic, 0.49);
  const auto moving = scene(model, scene::Method::ela, damped(GetParam()));
  moving->apply(scene::SetGravity{{0, 0, -9810}});
  double most = 0;
  for (int k = 0; k < 20; ++k) {
    moving->step(0.01);
    const Numbers u = shape(*moving, 0);
    most = test::larger(most, largest(u));
    EXPECT_NEAR(volume(model, u), volume(model, {}), 0.01 * volume(model, {}));
  }
  EXPECT_GT(most, quadratic ? 2 : 0.1); // far beyond small strains; linear elements lock
}

INSTANTIATE_TEST_SUITE_P(Laws, MovingSolid,
                         testing::Values(integrator::SolidLaw::corotational,
                                         integrator::SolidLaw::hyperelastic),
                         [](const auto& of) {
                           return of.param == gewebe::integrator::SolidLaw::corotational
                                      ? "corotational"
                                      : "neo_hookean";
                         });

/// A pressure turns with the face that it is on: tongs turn the end down and bear what it adds.
TEST(SimulationSolid, PressureFollowsTheShape) {
  const model::Model model = bar();
  const std::vector<std::uint32_t> end = end_of(model);
  std::vector<std::uint32_t> inner; // whose triangles are all of the face
  contact::Load load;
  for (const std::uint32_t node : end)
    if (const Vec3& p = model.nodes[node].position; p.y > 0 && p.y < 8 && p.z > 0 && p.z < 8) {
      inner.push_back(node);
      load.pressure[node] = {3000, 0};
    }
  double whole = 0;
  for (const auto& [node, force] : contact::load_at(load, model, 0).force)
    whole += force.x;
  EXPECT_GT(whole, 3000 * 30);
  Vec3 held;
  for (const double pressure : {0.0, 3000.0}) {
    const auto s = scene(model, scene::Method::ela, damped());
    s->apply(scene::SetInstrument{0, {0.5, {}, 0}, {{40, 4, 4}, {}}, "tongs"});
    s->apply(scene::Grasp{0, end, 0});
    s->apply(scene::MoveInstrument{0, {18, 4, -28}, contact::turn_about({0, 1, 0}, 90), 0.2});
    s->apply(scene::SetPressure{0, inner, {pressure, 0}});
    s->step(0.2);
    settle(*s);
    for (const contact::NodeVector& f : s->contact_forces(0))
      held += (pressure > 0 ? 1 : -1) * f.value;
  }
  EXPECT_NEAR(held.z, whole, 1e-6 * whole);
  EXPECT_NEAR(held.x, 0, 1e-6 * whole);
}

TEST(SimulationSolid, DisplacedNodesStandExactlyAndGoTheirWay) {
  const model::Model model = bar();
  const std::vector<std::uint32_t> end = end_of(model);
  const Vec3 to{0.1, -0.3, 1.7};
  const auto s = scene(model, scene::Method::ela, damped());
  s->apply(scene::SetDisplacement{0, end, to});
  s->step(0); // at once
  EXPECT_EQ(vector_at(s->displacement(0), end[0]), to);
  ASSERT_EQ(s->contact_forces(0).size(), end.size());
  EXPECT_GT(norm(s->contact_forces(0)[0].value), 0);
  s->step(0.05);
  EXPECT_EQ(vector_at(s->displacement(0), end[0]), to);
  const Vec3 back{0, 0.2, 0.3};
  s->apply(scene::SetDisplacement{0, end, back, 0.1});
  s->step(0.05);
  const Vec3 halfway = vector_at(s->displacement(0), end[0]);
  EXPECT_NEAR(norm(halfway - 0.5 * (to + back)), 0, 1e-12);
  s->step(0.05);
  EXPECT_EQ(vector_at(s->displacement(0), end[0]), back);
  // Let go it comes back.
  s->apply(scene::Release{0, end});
  settle(*s);
  EXPECT_LT(largest(s->displacement(0)), 1e-6);
}

TEST(SimulationSolid, AllNodesHeldGoTheirWayToo) {
  const model::Model model = bar(false);
  const auto s = scene(model, scene::Method::ela, damped());
  std::vector<std::uint32_t> free;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (model.nodes[i].fixed == model::fixed_none)
      free.push_back(i);
  s->apply(scene::SetDisplacement{0, free, {1, 0, 0}, 0.1});
  s->step(0.05);
  EXPECT_NEAR(vector_at(s->displacement(0), free[0]).x, 0.5, 1e-12);
  s->step(0.05);
  EXPECT_EQ(vector_at(s->displacement(0), free[0]), (Vec3{1, 0, 0}));
  EXPECT_GT(norm(s->contact_forces(0)[0].value) + norm(s->contact_forces(0)[1].value), 0);
}

TEST(SimulationSolid, AFreeBodyFallsAndIsPushedByItsForce) {
  model::Model model = bar();
  for (model::Node& node : model.nodes) {
    node.fixed = model::fixed_none;
    node.drag = 0;
  }
  const auto s = scene(model, scene::Method::ela, {});
  s->apply(scene::SetGravity{{0, 0, -9810}});
  s->apply(scene::SetTimestep{1e-3});
  s->step(0.1);
  double mass = 0, fallen = 0;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    mass += model.nodes[i].mass;
    fallen += model.nodes[i].mass * vector_at(s->displacement(0), i).z;
  }
  // g t (t + h)/2 by backward Euler.
  EXPECT_NEAR(fallen / mass, -9810 * 0.1 * 0.101 / 2, 1e-6);
}

/// From ffe to ela the shape stays; at rest there nothing moves, and back it does not jump.
TEST(SimulationSolid, ChangesItsMethodWithoutAJump) {
  const model::Model model = bar();
  const std::vector<std::uint32_t> end = end_of(model);
  const auto s = scene(model, scene::Method::ffe, damped());
  s->apply(scene::SetGravity{{0, 0, -2}});
  s->apply(scene::SetForce{0, {end[0]}, {0, 3, 0}});
  s->apply(scene::SetDisplacement{0, {end[3]}, {0, 1e-3, 0}});
  s->step(0.1);
  const Numbers before = shape(*s, 0);
  EXPECT_GT(largest(before), 1e-4);
  s->apply(scene::SetMethod{0, scene::Method::ela});
  s->step(0);
  EXPECT_LE(test::largest_difference(shape(*s, 0), before), 1e-12 * 20);
  s->step(0.01);
  EXPECT_LE(test::largest_difference(shape(*s, 0), before), 1e-4 * largest(before));
  settle(*s);
  s->apply(scene::SetMethod{0, scene::Method::ffe});
  s->step(0.1);
  EXPECT_LE(test::largest_difference(shape(*s, 0), before), 1e-12 * 20);
  ASSERT_EQ(s->news().jumps.size(), 1U);
  EXPECT_LE(s->news().jumps[0].size, 1e-4 * largest(before));
}

TEST(SimulationSolid, GraspedNodesTurnWithTheirInstrument) {
  const model::Model model = bar();
  const std::vector<std::uint32_t> end = end_of(model);
  const auto s = scene(model, scene::Method::ela, damped());
  s->apply(scene::SetInstrument{0, {0.5, {}, 0}, {{40, 4, 4}, {}}, "tongs"}); // beside it
  s->apply(scene::Grasp{0, end, 0});
  s->apply(scene::MoveInstrument{0, {40, 4, 4}, contact::turn_about({1, 0, 0}, 90), 0.2});
  s->step(0.3);
  for (const std::uint32_t node : end) {
    const Vec3 p = model.nodes[node].position, u = vector_at(s->displacement(0), node);
    EXPECT_NEAR(norm(p + u - Vec3{20, 4 - (p.z - 4), 4 + (p.y - 4)}), 0, 1e-9);
  }
  settle(*s);
  const scene::InstrumentReport report = s->instrument(0);
  EXPECT_GT(report.torque.x * -1, 1e3); // it wants back
  s->apply(scene::Withdraw{0});
  settle(*s);
  EXPECT_LT(largest(s->displacement(0)), 1e-5);
}

/// Steps of one length up to rounding keep their factor; what rests costs nothing.
TEST(SimulationSolid, OneFactorServesAllStepsAndRestIsFree) {
  const auto s = scene(bar(), scene::Method::ela, damped());
  s->apply(scene::SetGravity{{0, 0, -9810}});
  for (int k = 0; k < 30; ++k)
    s->step(0.1);
  const scene::SimulationCounts counts = s->counts();
  EXPECT_EQ(counts.solids.factors, 1U);
  EXPECT_EQ(counts.solids.steps, counts.integration);
  EXPECT_GE(counts.solids.rounds, counts.solids.steps);
  EXPECT_EQ(counts.solids.unfinished, 0U);
  EXPECT_GT(counts.resting, 0U);
  s->apply(scene::SetGravity{{0, 0, -9000}}); // wakes it
  s->step(0.1);
  EXPECT_GT(s->counts().integration, counts.integration);
}

TEST(SimulationSolid, TheSameBytesOnAnyNumberOfThreads) {
  const model::Model model = bar();
  const std::vector<std::uint32_t> end = end_of(model);
  const auto end_shape = [&](int threads) {
    Context context;
    context.threads = threads;
    const auto s = scene(model, scene::Method::ela, {}, {}, context);
    s->apply(scene::SetGravity{{0, 0, -9810}});
    s->apply(scene::SetPressure{0, end, {800, 0.03}});
    s->step(0.05);
    s->apply(scene::SetDisplacement{0, {end[0]}, {0, 0, 2}, 0.02});
    s->step(0.05);
    return shape(*s, 0);
  };
  const Numbers one = end_shape(1);
  EXPECT_GT(largest(one), 1);
  EXPECT_EQ(one, end_shape(2));
}

TEST(SimulationSolid, AStepThatCannotBeginIsTakenBack) {
  const model::Model model = bar();
  const std::vector<std::uint32_t> end = end_of(model);
  const auto run = [&](bool fails) {
    const auto s = scene(model, scene::Method::ela, {}, {.guard = true});
    s->apply(scene::SetGravity{{0, 0, -9810}});
    s->step(0.05);
    const Numbers before = shape(*s, 0);
    if (fails) {
      s->apply(scene::SetForce{0, {end[1]}, {0, 0, 1e300}});
      EXPECT_THROW(s->step(0.02), Error);
      EXPECT_EQ(shape(*s, 0), before);
      s->apply(scene::SetForce{0, {end[1]}, {}});
    }
    s->step(0.02);
    EXPECT_NE(shape(*s, 0), before);
    return shape(*s, 0);
  };
  EXPECT_EQ(run(true), run(false));
}

TEST(SimulationSolid, AStepThatFailsIsTakenBack) {
  const model::Model model = bar();
  const std::vector<std::uint32_t> end = end_of(model);
  // A step of ten integration steps is given up when it was asked for the `last` time: in the midst
  // of the rounds of one of them.
  int asked = 0, first = 0;
  const auto run = [&](bool fails, int last) {
    Context context = one_thread();
    asked = 0;
    context.cancelled = [&] { return ++asked == last; };
    const auto s = scene(model, scene::Method::ela, {}, {.guard = true}, context);
    s->apply(scene::SetGravity{{0, 0, -9810}});
    s->step(0.05);
    const Numbers before = shape(*s, 0);
    const std::uint64_t taken = s->counts().integration;
    s->apply(scene::SetTimestep{0.002});
    first = asked;
    if (fails) {
      s->apply(scene::SetForce{0, {end[1]}, {0, 0, 1e4}});
      EXPECT_THROW(s->step(0.02), Cancelled);
      EXPECT_EQ(asked, last);
      EXPECT_GT(last, first + 20);
      EXPECT_EQ(shape(*s, 0), before);
      EXPECT_EQ(s->time(), 0.05);
      EXPECT_EQ(s->counts().integration, taken);
      s->apply(scene::SetForce{0, {end[1]}, {}});
    }
    s->step(0.02);
    EXPECT_GT(s->counts().integration, taken + 5);
    EXPECT_NE(shape(*s, 0), before);
    return shape(*s, 0);
  };
  const Numbers expected = run(false, -1);
  const int of_step = asked - first;
  for (const double part : {0.3, 0.6, 0.9})
    EXPECT_EQ(run(true, first + static_cast<int>(part * of_step)), expected) << part;
}

/// Of a body that has turned as a whole stresses are those of its strain, told in space.
TEST(SimulationSolid, StressesOfTurnedElementsAreThoseOfTheirStrain) {
  const model::Model model = bar();
  const tetrahedra::TetMesh mesh = fem::element_mesh(model);
  const std::vector<fem::SolidMaterial> materials = fem::element_materials(model);
  const std::vector<fem::SolidElement> elements = fem::solid_elements(mesh, materials);
  const contact::Quaternion turn = contact::turn_about({1, 2, 3}, 130);
  Numbers stretched, turned;
  for (const model::Node& node : model.nodes) {
    const Vec3 p = node.position, to = {1.02 * p.x, 0.99 * p.y, p.z},
               there = contact::rotated(turn, to) + Vec3{3, 1, 2};
    for (int a = 0; a < 3; ++a) {
      stretched.push_back(to[a] - p[a]);
      turned.push_back(there[a] - p[a]);
    }
  }
  const auto at_rest = fem::solid_fields(mesh, materials, elements, stretched),
             in_space = fem::solid_fields(mesh, materials, elements, turned, {},
                                          fem::StrainFrames::elements);
  double largest_stress = 0;
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    largest_stress = test::larger(largest_stress, fem::von_mises(at_rest.node_stress[i]));
  EXPECT_GT(largest_stress, 100);
  const auto along = [](const linalg::SymmetricBlock& s, const Vec3& n) {
    return s[0] * n.x * n.x + s[3] * n.y * n.y + s[5] * n.z * n.z +
           2 * (s[1] * n.x * n.y + s[2] * n.x * n.z + s[4] * n.y * n.z);
  };
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    for (const Vec3& n : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0.6, 0, 0.8}})
      EXPECT_NEAR(along(in_space.node_stress[i], contact::rotated(turn, n)),
                  along(at_rest.node_stress[i], n), 1e-8 * largest_stress);
}

std::string refusal(const model::Model& model, const integrator::SolidChoice& choice = {}) {
  try {
    (void)scene(model, scene::Method::ela, choice);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(SimulationSolid, RefusesWhatItCantMove) {
  model::Model model = bar(false);
  EXPECT_EQ(refusal(model), "");
  model::Model light = model;
  light.nodes[3].mass /= 2;
  EXPECT_NE(refusal(light).find("object o: node 3 has a mass of"), std::string::npos);
  model::Model loose = model;
  loose.nodes.push_back({.position = {99, 0, 0}, .mass = 1, .drag = 1});
  EXPECT_NE(refusal(loose).find("is in no tetrahedron"), std::string::npos);
  EXPECT_NE(refusal(test::organ(1), damped()).find("has no tetrahedra"), std::string::npos);
}

/// How deep the deepest node is in a sphere.
double depth(const scene::Simulation& s, const model::Model& model, double radius) {
  const Vec3 centre = s.instrument(0).pose.place;
  double deepest = -HUGE_VAL;
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
    deepest = test::larger(
        deepest, radius - norm(model.nodes[i].position + vector_at(s.displacement(0), i) - centre));
  return deepest;
}

/// Pressed slowly a solid pushes back as the elastostatic one does; no node is in the instrument.
TEST(SimulationSolid, AnInstrumentPressesAsStaticsSays) {
  const model::Model model = bar();
  const auto still = scene(model, scene::Method::ffe, {}),
             moving = scene(model, scene::Method::ela, damped());
  for (scene::Simulation* const s : {still.get(), moving.get()}) {
    s->apply(scene::SetInstrument{0, {4, {}, 0}, {{18, 4, 12.5}, {}}, "probe"});
    s->step(0.01);
    s->apply(scene::MoveInstrument{0, {18, 4, 11.98}, {}, 0.1}); // 0.02 mm deep
    for (int k = 0; k < 20; ++k) {
      s->step(0.02);
      EXPECT_LE(depth(*s, model, 4), 4 * 2e-4);
    }
  }
  settle(*moving);
  EXPECT_LE(depth(*moving, model, 4), 4 * 2e-4);
  const scene::InstrumentReport a = still->instrument(0), b = moving->instrument(0);
  EXPECT_GT(a.nodes, 0U);
  EXPECT_GT(a.force.z, 10);
  EXPECT_LE(norm(a.force - b.force), 0.03 * norm(a.force));
  EXPECT_LE(test::largest_difference(shape(*moving, 0), shape(*still, 0)),
            0.03 * largest(shape(*still, 0)));
  moving->apply(scene::MoveInstrument{0, {18, 4, 40}, {}, 0});
  settle(*moving);
  EXPECT_EQ(moving->instrument(0).nodes, 0U);
  EXPECT_LE(largest(shape(*moving, 0)), 1e-5);
}

/// Swept by a fast instrument, and by one that jumps, nodes are pushed along and not passed.
TEST(SimulationSolid, NoInstrumentPassesIt) {
  for (const double duration : {0.05, 0.0}) {
    const model::Model model = bar();
    const auto s = scene(model, scene::Method::ela, damped());
    s->apply(scene::SetInstrument{0, {5, {0, 8, 0}, 0}, {{18, 0, 15}, {}}, "rod"});
    s->step(0.01);
    s->apply(scene::MoveInstrument{0, {18, 0, 5}, {}, duration});
    s->step(0.05);
    s->step(0.05);
    double lowest = HUGE_VAL;
    for (const std::uint32_t node : end_of(model))
      lowest = test::smaller(lowest, vector_at(s->displacement(0), node).z);
    EXPECT_LT(lowest, -6) << duration; // the end is below it, where it would else be inside
    EXPECT_GT(s->instrument(0).force.z, 100);
  }
}

TEST(SimulationSolid, WhatInstrumentsDoIsTheSameOnAnyThreadsAndBehindAStepBack) {
  const model::Model model = bar();
  const auto run = [&](int threads, bool back) {
    Context context;
    context.threads = threads;
    const auto s = scene(model, scene::Method::ela, {}, {.guard = true}, context);
    s->apply(scene::SetInstrument{0, {4, {}, 0.4}, {{18, 4, 12.5}, {}}, "probe"});
    s->apply(scene::MoveInstrument{0, {17, 4.5, 11}, {}, 0.1});
    s->step(0.05);
    if (back) {
      s->apply(scene::SetForce{0, {1}, {0, 0, 1e300}});
      EXPECT_THROW(s->step(0.02), Error);
      s->apply(scene::SetForce{0, {1}, {}});
    }
    s->step(0.05);
    s->step(0.05);
    EXPECT_GT(s->instrument(0).force.z, 10);
    return shape(*s, 0);
  };
  const Numbers one = run(1, false);
  EXPECT_EQ(one, run(2, false));
  EXPECT_EQ(one, run(2, true));
}

/// Pulled aside by 20 mm, its own length, within 0.05 s: steps by the tolerance that
/// is usual against solved ones.
TEST(SolidScene, FollowsALongPullAsSolvedStepsDo) {
  const model::Model model = bar(true, 0.49);
  std::vector<Numbers> path[2];
  for (const bool solved : {false, true}) {
    integrator::SolidChoice choice = damped();
    if (solved)
      choice.tolerance = 1e-8;
    scene::Simulation s(one_thread(), {});
    s.add_object("o", model, scene::Method::ela, {}, scene::Integration::semi_implicit, choice);
    s.apply(scene::SetDisplacement{0, end_of(model), {-8, 0, 20}, 0.05});
    for (int k = 0; k < 12; ++k) {
      s.step(1.0 / 60);
      path[solved ? 1 : 0].emplace_back(s.displacement(0).begin(), s.displacement(0).end());
    }
  }
  double most = 0;
  for (std::size_t k = 0; k < path[0].size(); ++k)
    most =
        test::larger(most, test::largest_difference(path[0][k], path[1][k]) / largest(path[1][k]));
  std::printf("a long pull: off by %.2e of the displacement at most\n", most);
  EXPECT_LT(most, 0.01);
}

std::uint32_t node_at(const model::Model& model, const Vec3& place) {
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (norm(model.nodes[i].position - place) < 1e-9)
      return i;
  ADD_FAILURE() << "no such node";
  return 0;
}

/// The surface of a body that nothing else holds.
TEST(SolidScene, AFreeBodyIsHeldWhereItsSurfaceIsDisplaced) {
  for (const bool quadratic : {true, false}) {
    model::Model model = bar(quadratic);
    for (model::Node& node : model.nodes)
      node.fixed = model::fixed_none;
    scene::Simulation s(one_thread(), {.guard = true});
    s.add_object("o", model, scene::Method::ffe);
    std::vector<std::uint32_t> all(model::surface_count(model));
    for (std::uint32_t i = 0; i < all.size(); ++i)
      all[i] = i;
    s.apply(scene::SetDisplacement{0, all, {1, 2, 3}});
    s.step(0.01);
    for (std::size_t i = 0; i < model.nodes.size(); ++i)
      EXPECT_LT(norm(vector_at(s.displacement(0), i) - Vec3{1, 2, 3}), 1e-9) << i;
    const std::vector<std::uint32_t> corners{all[0], node_at(model, {20, 0, 0}),
                                             node_at(model, {0, 8, 0})};
    std::erase_if(all, [&](std::uint32_t i) { return std::ranges::count(corners, i) > 0; });
    s.apply(scene::Release{0, all}); // three nodes hold it as well
    s.apply(scene::SetForce{0, {all.back()}, {0, 0, 1}});
    s.step(0.01);
    Vec3 sum{0, 0, 1};
    for (const contact::NodeVector& f : s.contact_forces(0))
      sum += f.value;
    EXPECT_LT(norm(sum), 1e-6);
    s.apply(scene::Release{0, {corners[2]}}); // now it can turn
    try {
      s.step(0.01);
      FAIL() << "it moved";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("singular"), std::string::npos) << error.what();
    }
    s.apply(scene::Release{0, corners}); // and nothing acts on it
    s.apply(scene::Release{0, all});
    s.step(0.01);
    EXPECT_EQ(largest(s.displacement(0)), 0);
  }
}

/// What hangs on the end of a bar.
constexpr double weight = 0.3; // g, on each node

TEST(HungMass, IsAWeightThatStaticsAndMotionCarry) {
  for (const bool quadratic : {true, false}) {
    const model::Model model = bar(quadratic);
    const std::vector<std::uint32_t> end = end_of(model);
    const Vec3 gravity{0, 0, -100};
    const auto ready = [&](scene::Method method, bool hung) {
      auto s =
          scene(model, method, method == scene::Method::ela ? damped() : integrator::SolidChoice());
      s->apply(scene::SetGravity{gravity});
      if (hung)
        s->apply(scene::SetMass{0, end, weight});
      else
        s->apply(scene::SetForce{0, end, weight * gravity});
      if (method == scene::Method::ela)
        settle(*s);
      else
        s->step(0.01);
      return s;
    };
    const auto hung = ready(scene::Method::ffe, true), pulled = ready(scene::Method::ffe, false),
               rests = ready(scene::Method::ela, true),
               rests_pulled = ready(scene::Method::ela, false);
    const double most = largest(pulled->displacement(0));
    EXPECT_GT(most, 1e-3);
    EXPECT_LT(test::largest_difference(hung->displacement(0), pulled->displacement(0)),
              1e-12 * most);
    EXPECT_LT(test::largest_difference(rests->displacement(0), rests_pulled->displacement(0)),
              1e-4 * most);
    hung->apply(scene::SetMass{0, end, 0}); // it is taken off
    hung->step(0.01);
    const auto alone = scene(model, scene::Method::ffe, {});
    alone->apply(scene::SetGravity{gravity});
    alone->step(0.01);
    EXPECT_LT(test::largest_difference(hung->displacement(0), alone->displacement(0)),
              1e-12 * most);
  }
}

/// ELA holds such masses: those of nodes beyond the tetrahedra's.
TEST(HungMass, InAModelIsTheSame) {
  const model::Model model = bar();
  const auto run = [](const model::Model& of, bool hangs) {
    auto s = scene(of, scene::Method::ela, damped());
    s->apply(scene::SetGravity{{0, 0, -9810}});
    if (hangs)
      s->apply(scene::SetMass{0, end_of(of), weight});
    for (int k = 0; k < 5; ++k)
      s->step(0.01);
    return s;
  };
  const auto hung = run(model, true);
  const model::Model heavier = hung->weighed_model(0);
  EXPECT_GT(model::total_mass(heavier), model::total_mass(model) + 0.99 * weight * 9);
  EXPECT_EQ(shape(*run(formats::parse_ela(formats::ela_text(heavier), "heavier"), false), 0),
            shape(*hung, 0));
  EXPECT_GT(test::largest_difference(shape(*run(model, false), 0), shape(*hung, 0)), 0.01);
}

TEST(HungMass, StaysWhereTheBodyIsCut) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    const model::Model model = bar();
    auto s = scene(model, method, damped(), {.guard = true});
    s->apply(scene::SetMass{0, end_of(model), weight});
    const double before = model::total_mass(s->weighed_model(0));
    s->step(0.001);
    s->apply(scene::CutObject{0, scene::PlaneToCut{{{11, 0, 4}, {1, 0, 0}}, {}, false}});
    ASSERT_EQ(s->object_count(), 2U);
    s->step(0.001);
    EXPECT_NEAR(model::total_mass(s->weighed_model(0)) + model::total_mass(s->weighed_model(1)),
                before, 1e-9 * before);
    EXPECT_GT(model::total_mass(s->weighed_model(1)), model::total_mass(s->model(1)) + weight);
    EXPECT_EQ(model::total_mass(s->weighed_model(0)), model::total_mass(s->model(0)));
  }
}

TEST(HungMass, IsTakenBackWithAStepThatFails) {
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela}) {
    const model::Model model = bar();
    const std::vector<std::uint32_t> end = end_of(model);
    const auto run = [&](bool fails) {
      auto s = scene(model, method, damped(), {.shapes = true, .guard = true});
      s->apply(scene::SetGravity{{0, 0, -981}});
      s->step(0.01);
      if (fails) {
        s->schedule(0.015, scene::SetMass{0, end, weight});
        s->schedule(0.016, scene::SetForce{0, end, {0, 0, 1e300}});
        EXPECT_THROW(s->step(0.01), Error);
        EXPECT_EQ(model::total_mass(s->weighed_model(0)), model::total_mass(s->model(0)));
        return std::vector<double>(shape(*s, 0));
      }
      return std::vector<double>(shape(*s, 0));
    };
    EXPECT_EQ(run(true), run(false));
  }
}

/// A silicone beam of 100 × 30 × 30 mm and 96.3 g, held at one end, with 102 g on the other.
/// Measured ones swing at 7.76 Hz without a load and at 4.33 Hz with 52 g: as 24 g on a spring,
/// which with 102 g more swing at 3.34 Hz.
TEST(HungMass, ABeamWithAWeightSwingsSlower) {
  fem::SolidModelOptions options;
  options.material.materials = {{"silicone", 1.07e-3, 270000, 1, 0.2, 0.499}};
  options.quadratic = true;
  model::Model model = fem::solid_model(test::box_tetrahedra(10, 3, 3, 10), options, {});
  std::vector<std::uint32_t> face;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    if (model.nodes[i].position.x == 0)
      model.nodes[i].fixed = model::fixed_all;
    if (model.nodes[i].position.x == 100)
      face.push_back(i);
  }
  integrator::SolidChoice choice;
  choice.damping = integrator::damping_per_stiffness(0.02, 3.3);
  const auto s = scene(model, scene::Method::ela, choice);
  s->apply(scene::SetMass{0, face, 102.0 / static_cast<double>(face.size())});
  s->apply(scene::SetGravity{{0, 0, -981}}); // a tenth, so that it bends little
  std::vector<double> times, down;
  for (int k = 1; k <= 180; ++k) {
    s->step(1.0 / 200);
    times.push_back(s->time());
    down.push_back(s->displacement(0)[3 * std::size_t{face[0]} + 2]);
  }
  const fit::SwingFit fit = fit::fit_swing(times, down);
  std::printf("a beam with 102 g swings at %.3f Hz\n", fit.frequency);
  EXPECT_NEAR(fit.frequency, 3.34, 0.02 * 3.34);
}

} // namespace
} // namespace gewebe::test
