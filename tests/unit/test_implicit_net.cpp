// Nets that move by the steps of solids: order, energy, momentum, stiffness of any ratio, and when
// that way is chosen.

#include "base/error.h"
#include "dynamics/elastodynamic.h"
#include "dynamics/solid_dynamic.h"
#include "geometry/mesh.h"
#include "geometry/vector_at.h"
#include "integrator/motion_volumes_internal.h"
#include "larger.h"
#include "random_nets.h"
#include "scene/simulation.h"
#include "sim_models.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <gtest/gtest.h>
#include <random>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using test::kicked, test::one_thread, test::organ;

integrator::SolidChoice to(double tolerance) {
  integrator::SolidChoice choice;
  choice.tolerance = tolerance;
  return choice;
}

double energy_of(const model::Model& model, const dynamics::BodyMotion& object) {
  return dynamics::kinetic_energy(model, object.motion()) +
         dynamics::elastic_energy(model, object.motion());
}

double implicit_error(int n) {
  const model::Model model = test::damped_pair();
  dynamics::SolidDynamic object(model, to(1e-9), one_thread());
  return test::error_of_damped_pair(object, n);
}

TEST(ImplicitNet, FollowsTheAnalyticDampedMotionWithOrderOne) {
  EXPECT_LT(implicit_error(4000), 2e-4);
  for (const int n : {500, 1000, 2000})
    EXPECT_NEAR(implicit_error(n) / implicit_error(2 * n), 2, 0.1) << n;
}

TEST(ImplicitNet, NeverGainsEnergyHoweverLongTheStep) {
  const model::Model model = organ(2);
  for (const double factor : {1.0, 30.0, 1000.0}) {
    dynamics::SolidDynamic object(model, {}, one_thread());
    object.set_motion(kicked(model, 0.3, 5));
    double energy = energy_of(model, object);
    const double h = factor * model::safe_step(model), first = energy;
    for (int k = 0; k < 20 && !object.resting(); ++k) {
      EXPECT_EQ(object.advance(h, h, one_thread()), 1U);
      const double now = energy_of(model, object);
      EXPECT_LE(now, energy * (1 + 1e-9) + 1e-20 * first) << factor << " " << k;
      energy = now;
    }
  }
  // The semi-implicit one does explode there: the steps are beyond its bound.
  dynamics::Elastodynamic object(model);
  object.set_motion(kicked(model, 0.3, 5));
  const double h = 30 * model::safe_step(model);
  EXPECT_THROW((void)object.advance(2000 * h, h, one_thread()), dynamics::MotionError);
}

TEST(ImplicitNet, KeepsMomentumAndAgreesWithManySmallSteps) {
  const model::Model model = test::freed(organ(1));
  const std::vector<dynamics::NodeMotion> start = kicked(model, 0.2, 3);
  dynamics::SolidDynamic object(model, to(1e-6), one_thread());
  dynamics::Elastodynamic fine(model);
  object.set_motion(start);
  fine.set_motion(start);
  const Vec3 before = dynamics::momentum(model, start);
  const double t = 20 * model::safe_step(model);
  (void)object.advance(t, t / 8000, one_thread());
  (void)fine.advance(t, t / 64000, one_thread());
  EXPECT_LT(norm(dynamics::momentum(model, object.motion()) - before), 1e-6 * norm(before));
  double error = 0, size = 0;
  for (std::size_t i = 0; i < start.size(); ++i) {
    error =
        test::larger(error, norm(object.motion()[i].displacement - fine.motion()[i].displacement));
    size = test::larger(size, norm(fine.motion()[i].displacement));
  }
  EXPECT_LT(error, 0.01 * size);
}

/// About the origin.
Vec3 angular_momentum(const model::Model& model, std::span<const dynamics::NodeMotion> motion) {
  Vec3 sum;
  for (std::size_t i = 0; i < motion.size(); ++i)
    sum += model.nodes[i].mass *
           cross(model.nodes[i].position + motion[i].displacement, motion[i].velocity);
  return sum;
}

/// The part of its angular momentum that a body turning at 4 rad/s loses in 0.25 s.
double lost_turning(double h) {
  model::Model model = test::freed(organ(2));
  Vec3 middle;
  double mass = 0;
  for (const model::Node& n : model.nodes) {
    middle += n.mass * n.position;
    mass += n.mass;
  }
  for (model::Node& n : model.nodes)
    n.position -= middle / mass;
  std::vector<dynamics::NodeMotion> motion(model.nodes.size());
  for (std::size_t i = 0; i < motion.size(); ++i)
    motion[i].velocity = cross({0, 0, 4}, model.nodes[i].position);
  dynamics::SolidDynamic object(model, to(1e-6), one_thread());
  object.set_motion(motion);
  const Vec3 before = angular_momentum(model, motion);
  (void)object.advance(0.25, h, one_thread());
  const Vec3 now = angular_momentum(model, object.motion());
  EXPECT_LT(norm(dynamics::momentum(model, object.motion())), 1e-9 * norm(before)) << h;
  return 1 - norm(now) / norm(before);
}

TEST(ImplicitNet, LosesAngularMomentumInProportionToTheStep) {
  const double usual = lost_turning(1.0 / 600), half = lost_turning(1.0 / 1200);
  std::printf("turning at 4 rad/s loses %.4f and %.4f of it in 0.25 s\n", usual, half);
  EXPECT_NEAR(usual, 4 * 4 * 0.25 / 600, 0.1 * usual); // w^2 h each second
  EXPECT_NEAR(usual / half, 2, 0.1);
}

/// Springs whose stiffnesses differ by up to this ratio, at random; the damping ratio stays.
model::Model uneven(double ratio) {
  model::Model model = organ(2);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> part(0, 1);
  for (model::Spring& s : model.springs) {
    const double by = std::pow(ratio, part(random));
    s.stiffness *= by;
    s.damping *= std::sqrt(by);
  }
  return model;
}

TEST(ImplicitNet, IsStableForAnyRatioOfStiffness) {
  for (const double ratio : {1.0, 1e2, 1e4, 1e6, 1e8}) {
    const model::Model model = uneven(ratio);
    for (const double h : {1.0 / 600, 1.0 / 60, 0.5}) {
      dynamics::SolidDynamic object(model, {}, one_thread());
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
    const model::Model model = uneven(ratio);
    EXPECT_EQ(model::safe_step(model) * 20 < 1.0 / 600, implicit);
    scene::Simulation s(one_thread(), {});
    s.add_object("o", {[&] { return model; }}, scene::Method::ela, scene::Integration::automatic);
    s.add_object("p", {[] { return organ(1); }}, scene::Method::ela, scene::Integration::automatic);
    s.apply(
        scene::Attach{1, {test::free_nodes(s.model(1))[0]}, 0, {test::free_nodes(model)[0]}, 10});
    s.apply(scene::SetForce{0, {test::free_nodes(model)[0]}, {0, 0, 100}});
    s.step(1.0 / 60);
    EXPECT_EQ(s.counts().integration <= 20, implicit) << s.counts().integration; // 10 of each
  }
}

/// As explicit steps have it.
TEST(ImplicitNet, WhatStaysWhereItIsNeedsNoMass) {
  const model::Model whole = organ(2);
  model::Model model = whole;
  for (model::Node& n : model.nodes)
    if (n.fixed == model::fixed_all)
      n.mass = 0;
  dynamics::SolidDynamic object(model, {}, one_thread()), other(whole, {}, one_thread());
  for (dynamics::SolidDynamic* const one : {&object, &other}) {
    one->set_motion(kicked(whole, 0.05, 20));
    (void)one->advance(0.1, 1.0 / 600, one_thread());
  }
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    EXPECT_EQ(object.motion()[i].displacement, other.motion()[i].displacement) << i;
  model.nodes[test::free_nodes(model)[0]].mass = 0;
  EXPECT_THROW(dynamics::SolidDynamic(model, {}, one_thread()), Error);
}

// ---- what fills them

double enclosed(const model::Model& model, std::span<const dynamics::NodeMotion> motion) {
  TriangleMesh mesh;
  for (std::size_t i = 0; i < motion.size(); ++i)
    mesh.points.push_back(model.nodes[i].position + motion[i].displacement);
  mesh.triangles = model.triangles;
  return signed_volume(mesh);
}

/// A membrane without what is inside, and of a tenth of the stiffness, held at some nodes below.
model::Model membrane() {
  model::Model model = organ(3);
  std::erase_if(model.springs, [&](const model::Spring& s) {
    return std::max(s.i, s.j) >= model::surface_count(model);
  });
  for (model::Spring& s : model.springs)
    s.stiffness *= 0.1;
  return model;
}

integrator::SolidChoice filled(double bulk) {
  integrator::SolidChoice choice;
  choice.bulk = bulk;
  return choice;
}

/// What it has of its volume where it rests under its weight.
double rests_with(const model::Model& model, const integrator::SolidChoice& choice) {
  dynamics::SolidDynamic object(model, choice, one_thread());
  contact::Load load;
  load.gravity = {0, 0, -9810};
  object.set_load(load, 0);
  for (int k = 0; k < 400 && !object.resting(); ++k)
    (void)object.advance(0.05, 1.0 / 60, one_thread());
  return enclosed(model, object.motion()) /
         enclosed(model, std::vector<dynamics::NodeMotion>(model.nodes.size()));
}

TEST(FilledNet, KeepsItsVolumeUnderItsWeight) {
  const model::Model model = membrane();
  const double empty = rests_with(model, {}), soft = rests_with(model, filled(1e3)),
               hard = rests_with(model, filled(1e6)), tissue = rests_with(model, filled(2e9));
  std::printf("volume at rest: empty %.4f, filled %.4f, %.6f, %.8f\n", empty, soft, hard, tissue);
  EXPECT_LT(empty, 0.97);
  EXPECT_GT(soft, empty);
  EXPECT_NEAR(hard, 1, 1e-3);
  EXPECT_NEAR(tissue, 1, 1e-6);
}

TEST(FilledNet, PushesWithTheGradientOfItsEnergyAndNothingAsAWhole) {
  const model::Model model = membrane();
  const std::vector<dynamics::NodeMotion> motion = kicked(model, 0.5, 0);
  std::vector<double> rest, at;
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    for (int a = 0; a < 3; ++a) {
      rest.push_back(model.nodes[i].position[a]);
      at.push_back(rest.back() + motion[i].displacement[a]);
    }
  integrator::MotionVolumes volumes(model.triangles, rest, 5e4);
  std::vector<double> forces(at.size()), scratch(at.size());
  const double energy = volumes.evaluate(at, forces);
  const double whole = enclosed(model, std::vector<dynamics::NodeMotion>(motion.size())),
               off = enclosed(model, motion) - whole;
  EXPECT_NEAR(energy, 5e4 * off * off / (2 * whole), 1e-9 * energy);
  Vec3 sum, turn;
  double size = 0;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i) {
    const Vec3 force = vector_at(forces, i);
    sum += force;
    turn += cross(vector_at(at, i), force);
    size = test::larger(size, norm(force));
  }
  EXPECT_GT(size, 0);
  EXPECT_LT(norm(sum), 1e-11 * size * static_cast<double>(motion.size()));
  EXPECT_LT(norm(turn), 1e-9 * size * static_cast<double>(motion.size()));
  for (std::size_t axis = 0; axis < at.size(); axis += 7) {
    std::vector<double> up = at, down = at;
    up[axis] += 1e-4;
    down[axis] -= 1e-4;
    EXPECT_NEAR((volumes.evaluate(down, scratch) - volumes.evaluate(up, scratch)) / 2e-4,
                forces[axis], 1e-5 * size)
        << axis;
  }
}

TEST(FilledNet, GainsNeitherEnergyNorMomentum) {
  const model::Model model = test::freed(membrane());
  // Springs at rest where they are would pull: of what fills it alone.
  const std::vector<dynamics::NodeMotion> start = kicked(model, 0.5, 0);
  const auto energy = [&](double bulk, std::span<const dynamics::NodeMotion> motion) {
    dynamics::SolidDynamic object(model, filled(bulk), one_thread());
    object.set_motion(motion);
    (void)object.advance(1e-9, 1e-9, one_thread());
    return object.energies()->elastic;
  };
  const double bulk = 5e4,
               off = 1 - enclosed(model, start) /
                             enclosed(model, std::vector<dynamics::NodeMotion>(start.size()));
  const double volume = enclosed(model, std::vector<dynamics::NodeMotion>(start.size()));
  EXPECT_NEAR(energy(bulk, start) - energy(bulk / 2, start), bulk / 4 * off * off * volume,
              1e-3 * bulk * off * off * volume);
  dynamics::SolidDynamic object(model, filled(bulk), one_thread());
  object.set_motion(kicked(model, 0.5, 20));
  const Vec3 before = dynamics::momentum(model, object.motion());
  double all = 0;
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    all += model.nodes[i].mass * norm(object.motion()[i].velocity);
  double last = HUGE_VAL;
  for (int k = 0; k < 100; ++k) {
    (void)object.advance(1.0 / 600, 1.0 / 600, one_thread());
    const double now = object.energies()->kinetic + object.energies()->elastic;
    EXPECT_LE(now, last * (1 + 1e-9)) << k;
    last = now;
  }
  EXPECT_LT(norm(dynamics::momentum(model, object.motion()) - before), 1e-9 * all);
}

TEST(FilledNet, RefusesWhatEnclosesNothing) {
  model::Model open = membrane();
  open.triangles.pop_back();
  EXPECT_THROW(dynamics::SolidDynamic(open, filled(1e3), one_thread()), Error);
  scene::Simulation s(one_thread(), {});
  EXPECT_THROW(s.add_object("o", membrane(), scene::Method::ela, {},
                            scene::Integration::semi_implicit, filled(1e3)),
               Error);
}

} // namespace
} // namespace gewebe::test
