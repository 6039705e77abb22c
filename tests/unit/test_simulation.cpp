#include "base/error.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::free_nodes, test::organ;

Context threads(int count) {
  Context context;
  context.threads = count;
  return context;
}

Vec3 moved(const scene::Simulation& s, std::size_t object, std::size_t node) {
  const std::span<const double> u = s.displacement(object);
  return {u[3 * node], u[3 * node + 1], u[3 * node + 2]};
}

TEST(Simulation, DisplacedNodesStandExactlyInBothMethods) {
  scene::Simulation s(threads(1), {});
  s.add_object("still", organ(), scene::Method::ffe);
  s.add_object("moving", organ(), scene::Method::ela);
  const std::vector<std::uint32_t> nodes = free_nodes(s.model(0));
  const Vec3 d{0.1, -1.0 / 3, 0.7};
  for (const std::size_t object : {0U, 1U})
    s.apply(scene::SetDisplacement{object, {nodes[0], nodes[9]}, d});
  for (int k = 0; k < 3; ++k) {
    s.step(0.01);
    for (const std::size_t object : {0U, 1U})
      for (const std::uint32_t node : {nodes[0], nodes[9]})
        EXPECT_EQ(moved(s, object, node), d);
  }
  EXPECT_NE(moved(s, 0, nodes[3]), Vec3{});
  EXPECT_NE(moved(s, 1, nodes[3]), Vec3{});
  // Both hold with about the same force once the moving one rests.
  s.step(20);
  const std::vector<contact::NodeVector>&a = s.contact_forces(0), &b = s.contact_forces(1);
  ASSERT_EQ(a.size(), 2U);
  ASSERT_EQ(b.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(a[k].node, b[k].node);
    EXPECT_LT(norm(a[k].value - b[k].value), 0.1 * norm(a[k].value));
  }
}

TEST(Simulation, ReleaseReturnsToRest) {
  scene::Simulation s(threads(1), {});
  s.add_object("still", organ(), scene::Method::ffe);
  s.add_object("moving", organ(), scene::Method::ela);
  const std::uint32_t node = free_nodes(s.model(0))[2];
  for (const std::size_t object : {0U, 1U}) {
    s.apply(scene::SetDisplacement{object, {node}, {0.1, 0.2, 0}});
    s.apply(scene::SetForce{object, {node + 1}, {10, 0, 0}});
  }
  s.step(0.1);
  for (const std::size_t object : {0U, 1U})
    s.apply(scene::Release{object, {node, node + 1}});
  s.step(30);
  for (const double value : s.displacement(0))
    EXPECT_EQ(value, 0);
  for (const double value : s.displacement(1))
    EXPECT_LT(std::abs(value), 1e-7);
  EXPECT_TRUE(s.contact_forces(0).empty());
}

TEST(Simulation, WithoutLoadNothingIsDone) {
  scene::Simulation s(threads(1), {});
  s.add_object("still", organ(), scene::Method::ffe);
  s.add_object("moving", organ(), scene::Method::ela);
  const std::uint64_t solves = s.counts().elastostatic.solves;
  for (int k = 0; k < 10; ++k)
    s.step(1);
  EXPECT_EQ(s.counts().elastostatic.solves, solves);
  EXPECT_EQ(s.counts().elastostatic.updates, 0U);
  EXPECT_EQ(s.counts().integration, 0U);
  EXPECT_EQ(s.counts().resting, 10U);
  s.apply(scene::SetForce{1, {free_nodes(s.model(1))[0]}, {1, 0, 0}});
  s.step(0.01);
  EXPECT_GT(s.counts().integration, 0U); // the counters count
}

TEST(Simulation, GravityIsOneSolution) {
  scene::Simulation s(threads(1), {.measure_error = true});
  s.apply(scene::SetGravity{{0, 0, -9810}});
  s.add_object("a", organ(), scene::Method::ffe); // under the present gravity
  s.step(1);
  EXPECT_EQ(s.counts().elastostatic.solves, 0U); // nobody asked for the shape yet
  const Vec3 once = moved(s, 0, 0);
  EXPECT_EQ(s.counts().elastostatic.solves, 1U);
  s.apply(scene::SetGravity{{0, 0, -2 * 9810}});
  s.step(1);
  EXPECT_LT(norm(moved(s, 0, 0) - 2 * once), 1e-12 * norm(once));
  EXPECT_LT(once.z, 0);
  EXPECT_LT(s.counts().elastostatic.backward_error, 1e-14);
  s.apply(scene::SetGravity{});
  s.step(1);
  EXPECT_EQ(moved(s, 0, 0), Vec3{});
}

TEST(Simulation, EventsSplitSteps) {
  const auto run = [](bool events) {
    scene::Simulation s(threads(1), {});
    s.add_object("a", organ(), scene::Method::ela);
    const std::uint32_t node = free_nodes(s.model(0))[1];
    const scene::SetForce push{0, {node}, {100, 0, 0}};
    const scene::Release let_go{0, {node}};
    if (events) {
      s.schedule(0.002, let_go);
      s.schedule(0.001, push);
      s.step(0.004);
    } else {
      s.step_to(0.001);
      s.apply(push);
      s.step_to(0.002);
      s.apply(let_go);
      s.step_to(0.004);
    }
    return std::vector<double>(s.displacement(0).begin(), s.displacement(0).end());
  };
  EXPECT_EQ(run(true), run(false));
}

TEST(Simulation, TheSameBytesForAnyNumberOfThreads) {
  std::vector<std::vector<double>> results;
  for (const int count : {1, 2, 3}) {
    scene::Simulation s(threads(count), {});
    model::BuildOptions options;
    s.add_object("still", model::build_model(test::ball(5, 20), options, Context{}).model,
                 scene::Method::ffe);
    s.add_object("moving", model::build_model(test::ball(5, 20), options, Context{}).model,
                 scene::Method::ela);
    s.apply(scene::SetGravity{{0, 0, -9810}});
    for (const std::size_t object : {0U, 1U}) {
      s.apply(scene::SetForce{object, {1, 7, 100}, {10, 20, 30}});
      s.apply(scene::SetDisplacement{object, {5, 900}, {0, 0.1, 0.2}});
    }
    s.step(0.002);
    std::vector<double>& result = results.emplace_back();
    for (const std::size_t object : {0U, 1U}) {
      result.insert(result.end(), s.displacement(object).begin(), s.displacement(object).end());
      for (const contact::NodeVector& f : s.contact_forces(object))
        result.insert(result.end(), {f.value.x, f.value.y, f.value.z});
    }
    ASSERT_EQ(0, std::memcmp(result.data(), results[0].data(), result.size() * sizeof(double)));
  }
}

TEST(Simulation, RefusesDisplacementAlongFixedAxesAndThePast) {
  scene::Simulation s(threads(1), {});
  s.add_object("a", organ(), scene::Method::ela);
  EXPECT_THROW(s.add_object("a", organ(), scene::Method::ela), Error);
  std::uint32_t node = 0;
  while (s.model(0).nodes[node].fixed != model::fixed_z)
    ++node;
  EXPECT_NO_THROW(s.apply(scene::SetDisplacement{0, {node}, {1, 1, 0}}));
  EXPECT_THROW(s.apply(scene::SetDisplacement{0, {node}, {0, 0, 1e-300}}), Error);
  s.step(1);
  EXPECT_THROW(s.schedule(0.5, scene::Emit{true}), Error);
  EXPECT_THROW(s.step_to(0.5), Error);
  EXPECT_THROW((void)scene::find_object(s, "b"), Error);
  EXPECT_EQ(scene::find_object(s, "a"), 0U);
  EXPECT_FALSE(s.settings().emits.forces);
  s.schedule(1, scene::Emit{true}); // now
  EXPECT_TRUE(s.settings().emits.forces);
  EXPECT_EQ(s.pending(), 0U);
}

/// Two organs, the second beside the first.
void add_two(scene::Simulation& s, scene::Method method = scene::Method::ela) {
  s.add_object("a", organ(), method);
  model::Model b = organ();
  for (model::Node& n : b.nodes)
    n.position.x += 41;
  s.add_object("b", std::move(b), scene::Method::ela);
}

TEST(Simulation, AttachedObjectsPullEachOtherAndTheOthersSleep) {
  const auto run = [](int count, bool attached) {
    scene::Simulation s(threads(count), {});
    add_two(s);
    s.add_object("c", organ(), scene::Method::ela);
    const std::vector<std::uint32_t> nodes = free_nodes(s.model(0));
    if (attached)
      s.apply(scene::Attach{0, {nodes[5], nodes[9]}, 1, free_nodes(s.model(1)), 5000});
    s.step(0.01); // the springs are at rest
    EXPECT_EQ(s.counts().integration, 0U);
    s.apply(scene::SetDisplacement{0, {nodes[5]}, {-1, 0, 0}});
    s.step(0.05);
    std::vector<double> result;
    for (const std::size_t object : {0U, 1U, 2U})
      result.insert(result.end(), s.displacement(object).begin(), s.displacement(object).end());
    return result;
  };
  const std::vector<double> tied = run(1, true), loose = run(1, false);
  const std::size_t n = tied.size() / 3;
  double moved = 0;
  for (std::size_t i = n; i < 2 * n; ++i) {
    moved = test::larger(moved, std::abs(tied[i]));
    EXPECT_EQ(loose[i], 0);
  }
  EXPECT_GT(moved, 1e-4);
  for (std::size_t i = 2 * n; i < tied.size(); ++i)
    EXPECT_EQ(tied[i], 0);
  EXPECT_EQ(run(2, true), tied);
}

TEST(Simulation, AttachKeepsTheMotionAndMomentumOfTheObjects) {
  scene::Simulation s(threads(1), {});
  add_two(s);
  const std::vector<std::uint32_t> nodes = free_nodes(s.model(0));
  s.apply(scene::SetForce{0, {nodes[3]}, {200, 0, 0}});
  s.step(0.02);
  const Vec3 before = moved(s, 0, nodes[3]);
  EXPECT_NE(before, Vec3{});
  s.apply(scene::Attach{0, {nodes[3]}, 1, {free_nodes(s.model(1))[0]}, 1});
  s.step(1e-9);
  EXPECT_LT(norm(moved(s, 0, nodes[3]) - before), 1e-4);
  s.apply(scene::Attach{0, {nodes[4]}, 1, {free_nodes(s.model(1))[1]}, 1}); // once more
  EXPECT_NO_THROW(s.step(0.01));
}

TEST(Simulation, ATieIsDampedByTheMeanRatioOfItsObjects) {
  // Of each object one mass hangs on the tie alone; drawn apart and let go, half a swing later they
  // are as near as the damping of a single oscillator leaves them.
  constexpr double pi = 3.14159265358979323846, stiffness = 400, force = 4;
  for (const bool first_is_stronger : {false, true}) {
    scene::Simulation s(threads(1), {});
    const double ratios[2]{first_is_stronger ? 0.5 : 0.1, first_is_stronger ? 0.1 : 0.5};
    for (const std::size_t object : {0U, 1U}) {
      model::Model model = test::two_masses(object == 0 ? 1 : 3, 0);
      model.materials[0].damping_ratio = ratios[object];
      for (model::Node& node : model.nodes)
        node.position.z += object == 0 ? 0 : 3;
      s.add_object(object == 0 ? "a" : "b", model, scene::Method::ela);
    }
    s.apply(scene::SetTimestep{1e-4});
    s.apply(scene::Attach{0, {1}, 1, {1}, stiffness});
    s.apply(scene::SetForce{0, {1}, {0, 0, -force}});
    s.apply(scene::SetForce{1, {1}, {0, 0, force}});
    s.step(5);
    const auto apart = [&] { return moved(s, 1, 1).z - moved(s, 0, 1).z; };
    const double drawn = apart();
    EXPECT_NEAR(drawn, force / stiffness, 1e-6);
    const std::vector<scene::AttachmentReport> attachments = s.attachments();
    ASSERT_EQ(attachments.size(), 1U);
    EXPECT_EQ(attachments[0].object, 0U);
    EXPECT_EQ(attachments[0].other, 1U);
    EXPECT_EQ(attachments[0].springs, 1U);
    EXPECT_NEAR(attachments[0].force.z, force, 1e-4); // it pulls against the force
    s.apply(scene::Release{0, {1}});
    s.apply(scene::Release{1, {1}});
    const double ratio = 0.3, damped = std::sqrt(1 - ratio * ratio);
    const double frequency = std::sqrt(stiffness / 0.75) * damped;
    s.step(pi / frequency);
    EXPECT_NEAR(apart() / drawn, -std::exp(-pi * ratio / damped), 0.01);
  }
}

TEST(Simulation, RefusesToAttachWhatHasNoMotion) {
  scene::Simulation s(threads(1), {});
  add_two(s, scene::Method::ffe);
  EXPECT_THROW(s.apply(scene::Attach{0, {1}, 1, {1}, 1}), Error);
  EXPECT_THROW(s.apply(scene::Attach{1, {1}, 1, {2}, 1}), Error);
  s.add_object("c", organ(), scene::Method::ela, {}, scene::Integration::implicit);
  EXPECT_THROW(s.apply(scene::Attach{1, {1}, 2, {2}, 1}), Error);
}

TEST(Simulation, SeveralObjectsMoveAsEachAlone) {
  const auto run = [](int count, bool both) {
    scene::Simulation s(threads(count), {});
    s.add_object("a", organ(), scene::Method::ela);
    if (both)
      s.add_object("b", organ(), scene::Method::ela, {}, scene::Integration::implicit);
    for (std::size_t object = 0; object < s.object_count(); ++object)
      s.apply(scene::SetForce{object, {free_nodes(s.model(0))[3]}, {100, 0, 0}});
    s.step(0.05);
    return std::vector<double>(s.displacement(0).begin(), s.displacement(0).end());
  };
  EXPECT_EQ(run(1, true), run(1, false));
  EXPECT_EQ(run(2, true), run(1, false));
}

TEST(Simulation, RepeatedEventsComeAtEveryMultiple) {
  scene::Simulation s(threads(1), {});
  s.add_object("a", organ(), scene::Method::ela);
  const std::uint32_t node = free_nodes(s.model(0))[3];
  s.schedule(s.time(), scene::SetForce{0, {node}, {100, 0, 0}}, 0.01);
  s.schedule(s.time(), scene::Release{0, {node}}, 0.015);
  EXPECT_EQ(s.pending(), 0U); // they never end
  s.step(0.0099);
  EXPECT_EQ(s.counts().integration, 0U);
  s.step_to(0.012);
  EXPECT_GT(s.counts().integration, 0U);
  const Vec3 pulled = moved(s, 0, node);
  EXPECT_GT(pulled.x, 0);
}

TEST(Simulation, ElastostaticObjectsFollowPulsesAndRamps) {
  scene::Simulation s(threads(1), {});
  s.add_object("a", organ(), scene::Method::ffe);
  const std::uint32_t node = free_nodes(s.model(0))[3];
  s.apply(scene::SetForce{0, {node}, {100, 0, 0}, 1});
  s.step_to(0.5);
  const Vec3 whole = moved(s, 0, node);
  s.step_to(1);
  EXPECT_LT(norm(moved(s, 0, node)), 1e-12 * norm(whole));
  s.step_to(1.5);
  EXPECT_EQ(moved(s, 0, node), whole);
  s.apply(scene::Release{0, {node}});
  s.apply(scene::SetDisplacement{0, {node}, {0, 1, 0}, 2});
  s.step_to(2.5);
  EXPECT_EQ(moved(s, 0, node), (Vec3{0, 0.5, 0}));
  s.step_to(4);
  EXPECT_EQ(moved(s, 0, node), (Vec3{0, 1, 0}));
  s.apply(scene::Release{0, {node}});
  s.apply(scene::SetPressure{0, free_nodes(s.model(0)), {100, 0}});
  s.step(1);
  EXPECT_NE(moved(s, 0, node), Vec3{});
}

TEST(Simulation, APressureOnAnElastostaticObjectPulsesWithItsPeriod) {
  const std::vector<std::uint32_t> nodes = free_nodes(organ());
  scene::Simulation steady(threads(1), {}), pulsing(threads(1), {});
  for (scene::Simulation* s : {&steady, &pulsing})
    s->add_object("a", organ(), scene::Method::ffe);
  steady.apply(scene::SetPressure{0, nodes, {100, 0}});
  steady.step(1);
  pulsing.apply(scene::SetPressure{0, nodes, {100, 0.8}});
  // Share of the whole: 3x² - 2x³ of the way to the midst of a period.
  const std::vector<std::pair<double, double>> shares{
      {0.2, 0.5}, {0.4, 1}, {0.7, 0.15625}, {0.8, 0}, {0.9, 0.15625}, {1.2, 1}, {1.4, 0.5}};
  for (const auto& [time, share] : shares) {
    pulsing.step_to(time);
    for (const std::uint32_t node : nodes) {
      const Vec3 whole = moved(steady, 0, node);
      EXPECT_LE(norm(moved(pulsing, 0, node) - share * whole), 1e-9 * norm(whole)) << time;
    }
  }
}

TEST(Simulation, AMillionRepeatedEventsAreRefused) {
  scene::SimulationOptions how;
  how.guard = true;
  scene::Simulation s(threads(1), how);
  s.add_object("a", organ(), scene::Method::ffe);
  const std::uint32_t node = free_nodes(s.model(0))[3];
  EXPECT_THROW(s.schedule(s.time(), scene::Release{0, {node}}, 1e-300), Error);
  EXPECT_THROW(s.apply(scene::SetForce{0, {node}, {1, 0, 0}, 1e-300}), Error);
  EXPECT_THROW(s.apply(scene::SetPressure{0, {node}, {1, 1e-10}}), Error);
  s.schedule(s.time(), scene::Release{0, {node}}, 1e-8);
  EXPECT_THROW(s.step(1), Error);
  EXPECT_EQ(s.time(), 0);
  s.step(1e-6);
  EXPECT_EQ(s.time(), 1e-6);
  EXPECT_THROW(s.step(1.7e308 + 1e307), Error);
}

TEST(Simulation, AnExplosionIsAFailedStepAndTheResultGoesOn) {
  scene::SimulationOptions how;
  how.guard = true;
  for (const scene::Method method : {scene::Method::ffe, scene::Method::ela})
    for (const double force : {1e18, 1e40, 1e300}) {
      scene::Simulation s(threads(1), how);
      s.add_object("a", organ(), method);
      s.apply(scene::Emit{});
      const std::uint32_t node = free_nodes(s.model(0))[3];
      s.apply(scene::SetForce{0, {node}, {1, 0, 0}});
      s.step(0.01);
      const std::vector<double> before(s.displacement(0).begin(), s.displacement(0).end());
      s.apply(scene::SetForce{0, {node}, {force, 0, 0}});
      EXPECT_THROW(s.step(0.01), Error) << scene::method_name(method) << force;
      EXPECT_EQ(s.time(), 0.01);
      EXPECT_EQ(std::vector<double>(s.displacement(0).begin(), s.displacement(0).end()), before);
      s.apply(scene::SetForce{0, {node}, {1, 0, 0}});
      s.step(0.01);
      // No such place is asked for, either.
      EXPECT_THROW(s.apply(scene::SetDisplacement{0, {node}, {1e300, 0, 0}}), Error);
      EXPECT_THROW(s.schedule(1, scene::SetDisplacement{0, {node}, {0, 1e9, 0}}), Error);
      EXPECT_THROW(
          s.apply(scene::SetInstrument{0, {0, {1, 0, 0}, 0, true}, {{1e300, 0, 0}, {}}, "k"}),
          Error);
      EXPECT_EQ(s.instrument_count(), 0U);
    }
}

} // namespace
} // namespace gewebe::test
