#include "base/error.h"
#include "dynamics/elastodynamic.h"
#include "larger.h"
#include "sim_models.h"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <random>

namespace gewebe::test {
namespace {

using test::one_thread, test::organ, test::two_masses;

/// Every node displaced and moving at random, except along fixed axes.
std::vector<dynamics::NodeMotion> shaken(const model::Model& model, double size) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-size, size);
  std::vector<dynamics::NodeMotion> motion(model.nodes.size());
  for (std::size_t i = 0; i < motion.size(); ++i)
    for (int a = 0; a < 3; ++a) {
      const double d = u(random), v = u(random);
      if (!contact::is_fixed(model, i, a)) {
        motion[i].displacement[a] = d;
        motion[i].velocity[a] = v;
      }
    }
  return motion;
}

TEST(SpringForce, ASpringPullsItsEndsOppositely) {
  // Bit for bit, whatever the numbers: else momentum would leak.
  const model::Model model = two_masses(1, 3.7, 0.3);
  const dynamics::SpringNetwork network = dynamics::spring_network(model);
  std::mt19937 random(1);
  std::normal_distribution<double> u(0, 10);
  for (int round = 0; round < 1000; ++round) {
    std::vector<dynamics::NodeMotion> motion(2);
    for (dynamics::NodeMotion& m : motion)
      m = {{u(random), u(random), u(random)}, {u(random), u(random), u(random)}};
    EXPECT_EQ(dynamics::spring_force(network, motion, 0),
              -dynamics::spring_force(network, motion, 1));
  }
}

TEST(SpringForce, IsTheGradientOfTheElasticEnergy) {
  const model::Model model = [] {
    model::Model m = organ();
    for (model::Spring& s : m.springs)
      s.damping = 0;
    return m;
  }();
  const dynamics::SpringNetwork network = dynamics::spring_network(model);
  std::vector<dynamics::NodeMotion> motion = shaken(model, 1);
  for (dynamics::NodeMotion& m : motion)
    m.velocity = {};
  const double h = 1e-6;
  for (const std::size_t i : {std::size_t{0}, std::size_t{17}, model.nodes.size() - 1}) {
    const Vec3 force = dynamics::spring_force(network, motion, i);
    for (int a = 0; a < 3; ++a) {
      std::vector<dynamics::NodeMotion> left = motion, right = motion;
      left[i].displacement[a] -= h;
      right[i].displacement[a] += h;
      const double slope =
          (dynamics::elastic_energy(model, right) - dynamics::elastic_energy(model, left)) /
          (2 * h);
      EXPECT_NEAR(force[a], -slope, 1e-5 * norm(force));
    }
  }
}

TEST(SpringForce, VanishesAtRestAndWhereEndsMeet) {
  const model::Model model = organ();
  const dynamics::SpringNetwork network = dynamics::spring_network(model);
  const std::vector<dynamics::NodeMotion> rest(model.nodes.size());
  for (std::size_t i = 0; i < rest.size(); ++i)
    EXPECT_EQ(dynamics::spring_force(network, rest, i), Vec3{});
  const model::Model two = two_masses();
  std::vector<dynamics::NodeMotion> meet(2);
  meet[0].displacement.x = 2;
  EXPECT_EQ(dynamics::spring_force(dynamics::spring_network(two), meet, 0), Vec3{});
  meet[0].displacement.x = 1.5; // and not elsewhere
  EXPECT_EQ(dynamics::spring_force(dynamics::spring_network(two), meet, 0).x, 0.5 - 2);
}

TEST(Elastodynamic, MomentumIsConserved) {
  model::Model model = organ();
  for (model::Node& n : model.nodes) {
    n.fixed = model::fixed_none;
    n.drag = 0;
  }
  dynamics::Elastodynamic object(model);
  object.set_motion(shaken(model, 1));
  const Vec3 before = dynamics::momentum(model, object.motion());
  double scale = 0;
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    scale += model.nodes[i].mass * norm(object.motion()[i].velocity);
  const double h = 0.5 * model::safe_step(model);
  EXPECT_EQ(object.advance(1000 * h, h, one_thread()), 1000U);
  EXPECT_LT(norm(dynamics::momentum(model, object.motion()) - before), 1e-12 * scale);
  EXPECT_GT(scale, 0);
  // Drag takes it: the check can fail.
  for (model::Node& n : model.nodes)
    n.drag = 1e-3 * n.mass;
  dynamics::Elastodynamic braked(model);
  braked.set_motion(shaken(model, 1));
  (void)braked.advance(1000 * h, h, one_thread());
  EXPECT_GT(norm(dynamics::momentum(model, braked.motion()) - before), 1e-9 * scale);
}

/// Largest deviation of the energy of two masses over ten periods, over the energy.
double energy_error(double part_of_safe_step) {
  const model::Model model = two_masses(2, 8);
  dynamics::Elastodynamic object(model);
  std::vector<dynamics::NodeMotion> motion(2);
  motion[0].velocity = {0.1, 0, 0};
  motion[1].velocity = {-0.1, 0, 0};
  object.set_motion(motion);
  const double energy = dynamics::kinetic_energy(model, motion),
               h = part_of_safe_step * model::safe_step(model);
  double worst = 0;
  for (int k = 0; k < static_cast<int>(70 / part_of_safe_step); ++k) {
    (void)object.advance(h, 2 * h, one_thread());
    const double now = dynamics::kinetic_energy(model, object.motion()) +
                       dynamics::elastic_energy(model, object.motion());
    worst = test::larger(worst, std::abs(now - energy) / energy);
  }
  return worst;
}

TEST(Elastodynamic, EnergyIsBoundedAndItsErrorIsOfOrderOne) {
  EXPECT_LT(energy_error(0.02), 0.05);
  EXPECT_GT(energy_error(0.02), 0.001);
  EXPECT_NEAR(energy_error(0.02) / energy_error(0.01), 2, 0.1);
  EXPECT_GT(energy_error(1.01), 10); // beyond the safe step it explodes
}

double position_error(int n) {
  const model::Model model = test::damped_pair();
  dynamics::Elastodynamic object(model);
  return test::error_of_damped_pair(object, n);
}

TEST(Elastodynamic, FollowsTheAnalyticDampedMotionWithOrderOne) {
  EXPECT_LT(position_error(10000), 1e-5);
  for (const int n : {500, 1000, 2000, 4000})
    EXPECT_NEAR(position_error(n) / position_error(2 * n), 2, 0.1) << n;
}

TEST(Elastodynamic, PeriodOfTwoMasses) {
  const double mass = 3, stiffness = 7;
  const model::Model model = two_masses(mass, stiffness);
  dynamics::Elastodynamic object(model);
  std::vector<dynamics::NodeMotion> motion(2);
  motion[0].displacement.x = -0.01;
  motion[1].displacement.x = 0.01;
  object.set_motion(motion);
  const double period = 2 * M_PI / std::sqrt(2 * stiffness / mass), h = period / 5000;
  double last = 0.01, time = 0, found = 0;
  for (int k = 0; k < 30000 && found == 0; ++k) {
    (void)object.advance(h, h, one_thread());
    time += h;
    const double x = object.motion()[1].displacement.x;
    if (time > 2.5 * period && last < 0 && x >= 0) // upwards for the third time: 2.75 periods
      found = (time - h * x / (x - last)) / 2.75;
    last = x;
  }
  EXPECT_NEAR(found / period, 1, 1e-3);
}

TEST(Elastodynamic, AFreeObjectFallsLikeAStone) {
  model::Model model = organ(1);
  for (model::Node& n : model.nodes) {
    n.fixed = model::fixed_none;
    n.drag = 0;
  }
  dynamics::Elastodynamic object(model);
  object.set_load({.gravity = {0, 0, -9810}});
  const double h = 0.5 * model::safe_step(model), t = 1000 * h;
  (void)object.advance(t, h, one_thread());
  const double expected = -9810 * (t * t + t * h) / 2; // of semi-implicit Euler
  for (const dynamics::NodeMotion& m : object.motion())
    EXPECT_NEAR(m.displacement.z / expected, 1, 1e-9);
}

TEST(Elastodynamic, FixedAxesStayAndDisplacedNodesStandExactly) {
  const model::Model model = organ();
  dynamics::Elastodynamic object(model);
  contact::Load load{.gravity = {100, 200, -9810}};
  load.force[3] = {1, 2, 3};
  load.displacement[7] = {0.1, -0.7, 1.0 / 3};
  object.set_load(load);
  EXPECT_EQ(object.motion()[7].displacement, load.displacement[7]);
  EXPECT_GT(object.advance(0.01, 0.9 * model::safe_step(model), one_thread()), 3U);
  bool moved_along_free = false;
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    for (int a = 0; a < 3; ++a)
      if (contact::is_fixed(model, i, a)) {
        EXPECT_EQ(object.motion()[i].displacement[a], 0) << i;
      } else {
        moved_along_free = moved_along_free || model.nodes[i].fixed != model::fixed_none;
      }
  EXPECT_TRUE(moved_along_free); // some node is fixed along one axis alone
  EXPECT_EQ(object.motion()[7].displacement, load.displacement[7]);
  EXPECT_EQ(object.motion()[7].velocity, Vec3{});
  EXPECT_NE(object.motion()[3].displacement, Vec3{});
}

TEST(Elastodynamic, AtRestForcesBalanceTheSupports) {
  const model::Model model = organ(2);
  dynamics::Elastodynamic object(model);
  contact::Load load{.gravity = {0, 0, -9810}};
  load.force[4] = {300, 0, 100};
  load.displacement[7] = {0.1, -0.2, 0.2};
  load.displacement[9] = {0, 0, 0};
  load.force[9] = {10, 20, 30}; // goes to the support
  object.set_load(load);
  for (int k = 0; k < 400 && !object.resting(); ++k)
    (void)object.advance(0.25, 0.9 * model::safe_step(model), one_thread());
  ASSERT_TRUE(object.resting());
  // Forces and moments of everything that acts from outside: loads, contacts, fixed axes.
  const dynamics::SpringNetwork network = dynamics::spring_network(model);
  Vec3 sum, turn;
  double scale = 0;
  const auto acts = [&](std::size_t i, const Vec3& f) {
    sum += f;
    turn += cross(model.nodes[i].position + object.motion()[i].displacement, f);
    scale += norm(f);
  };
  const std::vector<contact::NodeVector> contacts = object.contact_forces();
  ASSERT_EQ(contacts.size(), 2U);
  EXPECT_EQ(contacts[0].node, 7U);
  EXPECT_EQ(contacts[1].node, 9U);
  for (const contact::NodeVector& c : contacts)
    acts(c.node, c.value);
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    Vec3 outer = model.nodes[i].mass * load.gravity;
    if (load.force.contains(static_cast<std::uint32_t>(i)))
      outer += load.force.at(static_cast<std::uint32_t>(i));
    Vec3 reaction = -(dynamics::spring_force(network, object.motion(), i) + outer);
    for (int a = 0; a < 3; ++a)
      if (!contact::is_fixed(model, i, a))
        reaction[a] = 0;
    acts(i, outer + reaction);
  }
  EXPECT_GT(scale, 100);
  EXPECT_LT(norm(sum), 1e-8 * scale);
  EXPECT_LT(norm(turn), 1e-8 * scale * 100);
}

TEST(Elastodynamic, AtRestItTakesNoStep) {
  const model::Model model = organ();
  const double h = 0.9 * model::safe_step(model);
  dynamics::Elastodynamic object(model);
  EXPECT_EQ(object.advance(1, h, one_thread()), 0U);
  EXPECT_TRUE(object.resting());
  contact::Load load;
  load.force[4] = {100, 0, 0};
  object.set_load(load);
  EXPECT_FALSE(object.resting());
  EXPECT_GT(object.advance(0.1, h, one_thread()), 0U);
  for (int k = 0; k < 400 && !object.resting(); ++k)
    (void)object.advance(0.25, h, one_thread());
  EXPECT_TRUE(object.resting()); // under load too
  object.set_load(load);
  EXPECT_EQ(object.advance(0.1, h, one_thread()), 0U);
  EXPECT_GT(object.motion()[4].displacement.x, 0.001);
  object.set_load({}); // released, it comes back
  for (int k = 0; k < 400 && !object.resting(); ++k)
    (void)object.advance(0.25, h, one_thread());
  EXPECT_TRUE(object.resting());
  for (const dynamics::NodeMotion& m : object.motion())
    EXPECT_LT(norm(m.displacement), 1e-7);
  // A free node that glides has no force on it, but does not rest.
  model::Model two = two_masses(1, 1);
  two.springs.clear();
  dynamics::Elastodynamic gliding(two);
  std::vector<dynamics::NodeMotion> motion(2);
  motion[0].velocity.x = 1e-3;
  gliding.set_motion(motion);
  EXPECT_EQ(gliding.advance(1, 0.5, one_thread()), 2U);
  EXPECT_DOUBLE_EQ(gliding.motion()[0].displacement.x, 1e-3);
}

TEST(Elastodynamic, TheSameBytesForAnyNumberOfThreads) {
  model::BuildOptions options;
  options.centrals_free = true;
  const model::Model model = model::build_model(test::ball(5, 20), options, Context{}).model;
  std::vector<dynamics::NodeMotion> result;
  for (const int threads : {1, 2, 3}) {
    Context context;
    context.threads = threads;
    dynamics::Elastodynamic object(model);
    contact::Load load{.gravity = {0, 10, -9810}};
    load.force[11] = {50, 0, 0};
    load.displacement[100] = {0, 0, 1};
    object.set_load(load);
    const double h = 0.9 * model::safe_step(model);
    EXPECT_EQ(object.advance(20 * h, h, context), 20U);
    if (result.empty())
      result.assign(object.motion().begin(), object.motion().end());
    ASSERT_EQ(0, std::memcmp(result.data(), object.motion().data(),
                             result.size() * sizeof(dynamics::NodeMotion)));
  }
}

TEST(Elastodynamic, StepsAreEqualAndAtMostAsLongAsAsked) {
  const model::Model model = two_masses();
  const auto count = [&](double duration, double step) {
    dynamics::Elastodynamic object(model);
    std::vector<dynamics::NodeMotion> motion(2);
    motion[0].velocity.x = 0.1;
    object.set_motion(motion);
    return object.advance(duration, step, one_thread());
  };
  EXPECT_EQ(count(1, 0.1), 10U);
  EXPECT_EQ(count(0.3, 0.1), 3U); // 0.3 / 0.1 is a hair under 3
  EXPECT_EQ(count(0.7, 0.1), 7U); // and this one a hair under 7
  EXPECT_EQ(count(1, 0.0999), 11U);
  EXPECT_EQ(count(0.01, 0.1), 1U);
  EXPECT_EQ(count(0, 0.1), 0U);
  EXPECT_EQ(count(5, HUGE_VAL), 1U);
  EXPECT_THROW(count(1, 1e-12), Error);
  EXPECT_THROW(count(1, 0), Error);
}

TEST(Elastodynamic, RefusesWhatCannotMoveInTime) {
  model::Model model = two_masses(0);
  EXPECT_THROW(dynamics::Elastodynamic{model}, Error);
  for (model::Node& n : model.nodes)
    n.fixed = model::fixed_all;
  EXPECT_NO_THROW(dynamics::Elastodynamic{model});
}

TEST(Elastodynamic, AMotionThatExplodesIsAnError) {
  const model::Model model = two_masses();
  dynamics::Elastodynamic object(model);
  std::vector<dynamics::NodeMotion> motion(2);
  motion[0].velocity.x = 0.1;
  object.set_motion(motion);
  const double h = 2 * model::safe_step(model);
  EXPECT_THROW((void)object.advance(5000 * h, h, one_thread()), Error);
  dynamics::Elastodynamic still(model);
  contact::Load load;
  load.force[0] = {1e300, 0, 0};
  still.set_load(load);
  EXPECT_THROW((void)still.advance(1e8, 1, one_thread()), Error);
}

} // namespace
} // namespace gewebe::test
