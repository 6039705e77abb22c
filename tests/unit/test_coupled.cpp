// Instruments that a hand leads through a spring and a damper.

#include "base/error.h"
#include "contact_checks.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::larger, test::organ;

const Vec3 middle{100, -50, 30}; ///< of a ball of 20 mm
constexpr double radius = 8;

const std::vector<std::pair<scene::Method, scene::Integration>> ways{
    {scene::Method::ffe, scene::Integration::semi_implicit},
    {scene::Method::ela, scene::Integration::implicit},
    {scene::Method::ela, scene::Integration::semi_implicit}};

Vec3 above(double gap) {
  return middle + Vec3{0.3, 0.2, 20 + radius + gap};
}

/// An organ with a sphere just above it.
std::unique_ptr<scene::Simulation> scene(scene::Method method, scene::Integration integration,
                                         double friction = 0, int rounds = 3, double stiffer = 1) {
  auto s = std::make_unique<scene::Simulation>(test::one_thread(), scene::SimulationOptions{});
  model::Model model = organ(rounds);
  for (model::Spring& spring : model.springs)
    spring.stiffness *= stiffer;
  s->add_object("o", std::move(model), method, {}, integration);
  s->apply(scene::SetInstrument{0, {radius, {}, friction}, {above(0.1), {}}, "probe"});
  return s;
}

double depth(const scene::Simulation& s) {
  const scene::InstrumentReport tool = s.instrument(0);
  return test::surface_depth(s.model(0), s.displacement(0), tool.shape, tool.pose);
}

TEST(Coupled, AtRestSpringAndTissueShareTheWay) {
  const double k = 2000;
  for (const auto& [method, integration] : ways) {
    const auto led = scene(method, integration, 0, 2), held = scene(method, integration, 0, 2);
    led->apply(scene::SetCoupling{0, contact::Coupling{k, 50}});
    led->apply(scene::MoveInstrument{0, above(-3), {}, 0.2});
    for (int i = 0; i < 20; ++i)
      led->step(0.01);
    led->step(method == scene::Method::ffe ? 1 : 1.5);
    led->step(0.1);
    const scene::InstrumentReport tool = led->instrument(0);
    ASSERT_TRUE(tool.hand);
    EXPECT_EQ(*tool.hand, above(-3));
    const Vec3 lag = *tool.hand - tool.pose.place;
    EXPECT_GT(-lag.z, 0.3);
    EXPECT_LT(-lag.z, 3.2);
    // One balances the other; what moves still comes to rest, and tells means over steps.
    EXPECT_LE(norm(tool.force + k * lag),
              (method == scene::Method::ffe ? 1e-4 : 1e-2) * norm(tool.force));
    EXPECT_LE(std::abs(depth(*led)), test::depth_allowed); // touches, but for d_hat
    // Led there without a coupling it feels the same, but for the gap: the barrier's stiffness is
    // of the forces on the way, so that gaps differ by some hundredths of d_hat, of 0.24 mm of
    // dent.
    held->apply(scene::MoveInstrument{0, tool.pose.place, {}, 0.2});
    held->step(method == scene::Method::ffe ? 0.2 : 1.5);
    held->step(0.1);
    EXPECT_LE(norm(held->instrument(0).force - tool.force),
              (method == scene::Method::ffe ? 1e-3 : 2e-2) * norm(tool.force));
  }
}

TEST(Coupled, FreeItFollowsTheHandAsTheDamperLetsIt) {
  for (const auto& [method, integration] : ways) {
    const auto s = scene(method, integration);
    s->apply(scene::SetCoupling{0, contact::Coupling{1000, 100}});
    s->step(0.01);
    const Vec3 from = above(0.1), to = from + Vec3{0, 0, 5};
    s->apply(scene::MoveInstrument{0, to, {}, 0}); // away
    s->step(0.01);
    // D (e - 0 - ...)/h + K e = 0 with e_before = 0: massless, it is where the hand is.
    EXPECT_LE(norm(s->instrument(0).pose.place - to), 1e-12);
    EXPECT_EQ(norm(s->instrument(0).force), 0);
  }
}

/// Sums of what a hand gives, over random ways that come back, at every moment.
TEST(Coupled, NeverGivesWhatItWasNotGiven) {
  for (const auto& [method, integration] : ways)
    for (const double friction : {0.0, 0.3}) {
      const auto s = scene(method, integration, friction, 2);
      s->apply(scene::SetCoupling{0, contact::Coupling{3000, 5}});
      s->step(0.001);
      double given = 0, least = 0, most = 0;
      Vec3 last = above(0.1), before;
      const double step = 0.001;
      for (int i = 1; i <= 400; ++i) {
        const double t = i * 2 * 3.14159265358979 / 400;
        const Vec3 to =
            above(0.1) + Vec3{2 * std::sin(3 * t), std::sin(2 * t), -1.5 * (1 - std::cos(2 * t))};
        s->apply(scene::MoveInstrument{0, to, {}, method == scene::Method::ffe ? 0 : step});
        s->step(step);
        const Vec3 force = s->instrument(0).force;
        given -= dot(method == scene::Method::ffe ? 0.5 * (force + before) : force, to - last);
        before = force;
        last = to;
        least = test::smaller(least, given);
        most = numeric::larger(most, given);
        EXPECT_LE(depth(*s), test::depth_allowed);
      }
      EXPECT_GT(most, 0);
      EXPECT_GE(least, -2e-3 * most) << friction << scene::method_name(method);
    }
}

/// A hand, a mass on a spring, that feels the device's force one sample late, for so many seconds.
/// \return the largest excursion in the first and in the last second, mm
std::pair<double, double> held_by_hand(const std::optional<contact::Coupling>& coupling,
                                       double seconds) {
  const auto s = scene(scene::Method::ffe, scene::Integration::semi_implicit, 0, 2, 1000);
  if (coupling)
    s->apply(scene::SetCoupling{0, *coupling});
  // 50 g, 300 N/m, 1 N s/m (of an arm that holds lightly), by exact steps of the sample.
  const double mass = 50, spring = 3e5, damper = 1000, h = 0.001;
  const double rest = -1.5; // where it wants to be, below the surface
  double z = 0.1, v = 0, felt = 0, late = 0, first = 0, last = 0;
  const int steps = static_cast<int>(seconds / h);
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (int i = 0; i < steps; ++i) {
    v = (mass * v + h * (spring * (rest - z) + late)) / (mass + h * damper + h * h * spring);
    z += h * v;
    s->apply(scene::MoveInstrument{0, above(z), {}, 0});
    s->step(h);
    late = std::exchange(felt, s->instrument(0).force.z);
    low = test::smaller(low, z);
    high = numeric::larger(high, z);
    if (std::abs(z) > 2) // it is thrown about
      return {first, high - low};
    if ((i + 1) % 1000 == 0) {
      (i < 1000 ? first : last) = high - low;
      low = HUGE_VAL;
      high = -HUGE_VAL;
    }
  }
  return {first, last};
}

TEST(Coupled, AHandAtOneKilohertzStaysQuietOnStiffTissue) {
  const auto [first, last] = held_by_hand(contact::Coupling{5e5, 500}, 2);
  EXPECT_GT(first, 0.1); // it comes down
  EXPECT_LE(last, 1e-3);
  const auto [before, behind] = held_by_hand(std::nullopt, 2);
  EXPECT_GT(behind, 0.02) << before;
}

TEST(Coupled, WhatItIsNotForIsRefused) {
  const auto s = scene(scene::Method::ffe, scene::Integration::semi_implicit);
  EXPECT_THROW(s->apply(scene::SetCoupling{1, contact::Coupling{}}), std::exception);
  s->apply(scene::SetInstrument{1, {0, {1, 0, 0}, 0, true}, {above(9), {}}, "blade"});
  EXPECT_THROW(s->apply(scene::SetCoupling{1, contact::Coupling{}}), Error);
  s->apply(scene::SetCoupling{0, contact::Coupling{}});
  const std::uint32_t free = test::free_nodes(s->model(0)).front();
  EXPECT_THROW(s->apply(scene::Grasp{0, {free}, 0}), Error);
  s->apply(scene::SetCoupling{0, std::nullopt});
  s->apply(scene::Grasp{0, {free}, 0});
  EXPECT_THROW(s->apply(scene::SetCoupling{0, contact::Coupling{}}), Error);
}

} // namespace
} // namespace gewebe::test
