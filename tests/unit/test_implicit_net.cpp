// Nets that move by the steps of solids: order, energy, momentum, stiffness of any ratio, and when
// that way is chosen.

#include "dynamics/elastodynamic.h"
#include "dynamics/solid_dynamic.h"
#include "larger.h"
#include "random_nets.h"
#include "scene/simulation.h"
#include "sim_models.h"

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <gtest/gtest.h>
#include <random>
#include <span>
#include <utility>
#include <vector>

namespace gewebe {
namespace {

using test::kicked, test::one_thread, test::organ, test::two_masses;

SolidChoice to(double tolerance) {
  SolidChoice choice;
  choice.tolerance = tolerance;
  return choice;
}

Model free_organ(int rounds) {
  Model model = organ(rounds);
  for (Node& n : model.nodes) {
    n.fixed = fixed_none;
    n.drag = 0;
  }
  return model;
}

double energy_of(const Model& model, const BodyMotion& object) {
  return kinetic_energy(model, object.motion()) + elastic_energy(model, object.motion());
}

/// Where mass 1 of a damped pair is at time 1 by backward Euler steps of 1/n, against the analytic
/// motion.
double implicit_error(int n) {
  const double mass = 2, stiffness = 50, damping = 1, drag = 0.4, v = 0.3;
  const Model model = two_masses(mass, stiffness, damping, drag);
  SolidDynamic object(model, to(1e-9), one_thread());
  std::vector<NodeMotion> motion(2);
  motion[0].velocity.x = -v;
  motion[1].velocity.x = v;
  object.set_motion(motion);
  (void)object.advance(1, 1.0 / n, one_thread());
  const double decay = (2 * damping + drag) / mass / 2;
  const double omega = std::sqrt(2 * stiffness / mass - decay * decay);
  return std::abs(object.motion()[1].displacement.x -
                  v / omega * std::exp(-decay) * std::sin(omega));
}

TEST(ImplicitNet, FollowsTheAnalyticDampedMotionWithOrderOne) {
  EXPECT_LT(implicit_error(4000), 2e-4);
  for (const int n : {500, 1000, 2000})
    EXPECT_NEAR(implicit_error(n) / implicit_error(2 * n), 2, 0.1) << n;
}

TEST(ImplicitNet, NeverGainsEnergyHoweverLongTheStep) {
  const Model model = organ(2);
  for (const double factor : {1.0, 30.0, 1000.0}) {
    SolidDynamic object(model, {}, one_thread());
    object.set_motion(kicked(model, 0.3, 5));
    double energy = energy_of(model, object);
    const double h = factor * safe_step(model), first = energy;
    for (int k = 0; k < 20 && !object.resting(); ++k) {
      EXPECT_EQ(object.advance(h, h, one_thread()), 1U);
      const double now = energy_of(model, object);
      EXPECT_LE(now, energy * (1 + 1e-9) + 1e-20 * first) << factor << " " << k;
      energy = now;
    }
  }
  // The semi-implicit one does explode there: the steps are beyond its bound.
  Elastodynamic object(model);
  object.set_motion(kicked(model, 0.3, 5));
  const double h = 30 * safe_step(model);
  EXPECT_THROW((void)object.advance(2000 * h, h, one_thread()), MotionError);
}

TEST(ImplicitNet, KeepsMomentumAndAgreesWithManySmallSteps) {
  const Model model = free_organ(1);
  const std::vector<NodeMotion> start = kicked(model, 0.2, 3);
  SolidDynamic object(model, to(1e-6), one_thread());
  Elastodynamic fine(model);
  object.set_motion(start);
  fine.set_motion(start);
  const Vec3 before = momentum(model, start);
  const double t = 20 * safe_step(model);
  (void)object.advance(t, t / 8000, one_thread());
  (void)fine.advance(t, t / 64000, one_thread());
  EXPECT_LT(norm(momentum(model, object.motion()) - before), 1e-6 * norm(before));
  double error = 0, size = 0;
  for (std::size_t i = 0; i < start.size(); ++i) {
    error =
        test::larger(error, norm(object.motion()[i].displacement - fine.motion()[i].displacement));
    size = test::larger(size, norm(fine.motion()[i].displacement));
  }
  EXPECT_LT(error, 0.01 * size);
}

/// About the origin.
Vec3 angular_momentum(const Model& model, std::span<const NodeMotion> motion) {
  Vec3 sum;
  for (std::size_t i = 0; i < motion.size(); ++i)
    sum += model.nodes[i].mass *
           cross(model.nodes[i].position + motion[i].displacement, motion[i].velocity);
  return sum;
}

/// The part of its angular momentum that a body turning at 4 rad/s loses in 0.25 s.
double lost_turning(double h) {
  Model model = free_organ(2);
  Vec3 middle;
  double mass = 0;
  for (const Node& n : model.nodes) {
    middle += n.mass * n.position;
    mass += n.mass;
  }
  for (Node& n : model.nodes)
    n.position -= middle / mass;
  std::vector<NodeMotion> motion(model.nodes.size());
  for (std::size_t i = 0; i < motion.size(); ++i)
    motion[i].velocity = cross({0, 0, 4}, model.nodes[i].position);
  SolidDynamic object(model, to(1e-6), one_thread());
  object.set_motion(motion);
  const Vec3 before = angular_momentum(model, motion);
  (void)object.advance(0.25, h, one_thread());
  const Vec3 now = angular_momentum(model, object.motion());
  EXPECT_LT(norm(momentum(model, object.motion())), 1e-9 * norm(before)) << h;
  return 1 - norm(now) / norm(before);
}

TEST(ImplicitNet, LosesAngularMomentumInProportionToTheStep) {
  const double usual = lost_turning(1.0 / 600), half = lost_turning(1.0 / 1200);
  std::printf("turning at 4 rad/s loses %.4f and %.4f of it in 0.25 s\n", usual, half);
  EXPECT_NEAR(usual, 4 * 4 * 0.25 / 600, 0.1 * usual); // w^2 h each second
  EXPECT_NEAR(usual / half, 2, 0.1);
}

/// Springs whose stiffnesses differ by up to this ratio, at random; the damping ratio stays.
Model uneven(double ratio) {
  Model model = organ(2);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> part(0, 1);
  for (Spring& s : model.springs) {
    const double by = std::pow(ratio, part(random));
    s.stiffness *= by;
    s.damping *= std::sqrt(by);
  }
  return model;
}

TEST(ImplicitNet, IsStableForAnyRatioOfStiffness) {
  for (const double ratio : {1.0, 1e2, 1e4, 1e6, 1e8}) {
    const Model model = uneven(ratio);
    for (const double h : {1.0 / 600, 1.0 / 60, 0.5}) {
      SolidDynamic object(model, {}, one_thread());
      object.set_motion(kicked(model, 0.05, 20));
      double energy = energy_of(model, object);
      const double first = energy;
      for (int k = 0; k < 60 && !object.resting(); ++k) {
        (void)object.advance(h, h, one_thread());
        const double now = energy_of(model, object);
        EXPECT_LE(now, energy * (1 + 1e-9) + 1e-14 * first) << ratio << " " << h << " " << k;
        energy = now;
      }
      EXPECT_LT(energy, 0.9 * first) << ratio << " " << h;
    }
  }
}

TEST(ImplicitNet, IsChosenWhereExplicitStepsWouldBeTooMany) {
  for (const auto& [ratio, implicit] : {std::pair{1.0, false}, std::pair{1e8, true}}) {
    const Model model = uneven(ratio);
    EXPECT_EQ(safe_step(model) * 20 < 1.0 / 600, implicit);
    Simulation s(one_thread(), {});
    s.add_object("o", {[&] { return model; }}, Method::ela, Integration::automatic);
    s.add_object("p", {[] { return organ(1); }}, Method::ela, Integration::automatic);
    s.apply(Attach{1, {test::free_nodes(s.model(1))[0]}, 0, {test::free_nodes(model)[0]}, 10});
    s.apply(SetForce{0, {test::free_nodes(model)[0]}, {0, 0, 100}});
    s.step(1.0 / 60);
    EXPECT_EQ(s.counts().integration <= 20, implicit) << s.counts().integration; // 10 of each
  }
}

} // namespace
} // namespace gewebe
