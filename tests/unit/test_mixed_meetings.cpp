// Elastostatic objects that touch what moves: what answers say must meet the conditions of contact,
// judged by other means than those that found them.

#include "base/error.h"
#include "geometry/vector_at.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "static_blocks.h"
#include "touching_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using namespace test;

constexpr double h = 1.0 / 600; ///< steps of one step of integration each
/// Part of the largest displacement to which shapes and forces agree at rest, and while what moves
/// is translated, by a small part of the gap, so that it has the momentum of its forces.
constexpr double balance_met = 1e-5, balance_moving = 1e-2;

/// A block that falls on an elastostatic one.
void falls_on(scene::Simulation& s, const Vec3& corner, double friction) {
  add_static(s, "below", block(5, 5, 2, {}, true));
  add(s, "above", block(3, 3, 2, corner));
  s.apply(scene::SetContact{0, 1, friction});
  s.apply(scene::SetGravity{{0, 0, -9810}});
  s.apply(scene::SetTimestep{h});
}

contact::Load weight_alone() {
  contact::Load load;
  load.gravity = {0, 0, -9810};
  return load;
}

TEST(MixedMeetings, ABlockThatMovesRestsOnAnElastostaticOne) {
  for (const double friction : {0.0, 0.3}) {
    scene::Simulation s(one_thread(), {});
    falls_on(s, {3.7, 4.1, 8.3}, friction);
    bool touched = false;
    for (int k = 0; k < 160; ++k) {
      s.step(h);
      EXPECT_GT(least_gap(s, 0, 1), 0) << k;
      const Vec3 up = sum_of_forces(s, 1), down = sum_of_forces(s, 0);
      EXPECT_GE(up.z, 0) << k;
      EXPECT_LE(norm(up + down), 1e-12 * norm(up)) << k;
      EXPECT_LE(std::hypot(up.x, up.y), (friction + 0.05) * up.z) << k;
      EXPECT_LE(miss_of_balance(s, 0, weight_alone()), balance_moving) << k;
      touched = touched || up.z > 0;
    }
    EXPECT_TRUE(touched);
    for (int k = 0; k < 200; ++k)
      s.step(h);
    EXPECT_LE(miss_of_balance(s, 0, weight_alone()), balance_met);
    EXPECT_NEAR(sum_of_forces(s, 1).z, weight_of(s, 1), 1e-4 * weight_of(s, 1));
    EXPECT_LE(least_gap(s, 0, 1), gap_allowed);
  }
}

/// Where both come to rest they stand as if both moved.
TEST(MixedMeetings, AtRestItIsAsIfBothMoved) {
  std::vector<double> sunk;
  for (const bool moves : {false, true}) {
    scene::Simulation s(one_thread(), {});
    const model::Model below = block(5, 5, 2, {}, true);
    if (moves)
      add(s, "below", below);
    else
      add_static(s, "below", below);
    const model::Model above = block(3, 3, 2, {3.7, 4.1, 8.05});
    add(s, "above", above);
    s.apply(scene::SetContact{0, 1, 0.4});
    s.apply(scene::SetGravity{{0, 0, -9810}});
    s.apply(scene::SetTimestep{h});
    s.apply(scene::SetForce{1, nodes_below(above, 9), {0, 0, -2000}});
    for (int k = 0; k < 60; ++k)
      s.step(1.0 / 60);
    sunk.push_back(s.displacement(1)[2]);
  }
  EXPECT_LT(sunk[0], -0.05);
  EXPECT_NEAR(sunk[0], sunk[1], 0.05 * std::abs(sunk[1]));
}

/// Neither what moves passes what stands in one step, nor the other way round.
TEST(MixedMeetings, NothingJumpsThrough) {
  for (const bool static_jumps : {false, true}) {
    scene::Simulation s(one_thread(), {});
    const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 10.5});
    const model::Model below = block(5, 5, 2, {}, true);
    const std::vector<std::uint32_t> lowest = nodes_below(above, 11);
    if (static_jumps) {
      add(s, "below", below);
      add_static(s, "above", above);
    } else {
      add_static(s, "below", below);
      add(s, "above", above);
    }
    s.apply(scene::SetContact{0, 1, 0});
    s.step(h);
    const Vec3 force{0, 0, -100000.0};
    s.apply(scene::SetForce{1, lowest, force});
    contact::Load push;
    for (const std::uint32_t node : lowest)
      push.force[node] = force;
    bool touched = false;
    for (int k = 0; k < 30; ++k) {
      s.step(h);
      const Vec3 up = sum_of_forces(s, 1);
      touched = touched || up.z > 0;
      EXPECT_GT(least_gap(s, 0, 1), 0) << k;
      // Steps that are taken in halves tell means of what moves.
      EXPECT_LE(norm(up + sum_of_forces(s, 0)), (k > 15 ? 1e-12 : 2) * norm(up)) << k;
      EXPECT_LE(static_jumps ? miss_of_balance(s, 1, push) : miss_of_balance(s, 0, {}),
                balance_moving)
          << k;
    }
    EXPECT_TRUE(touched);
  }
}

TEST(MixedMeetings, FarApartNothingIsDifferent) {
  const auto shapes = [](bool may_touch) {
    return shapes_far_apart(add, {500, 0, -2000}, may_touch);
  };
  EXPECT_EQ(shapes(false), shapes(true));
}

/// A beam that is held at one end, over a block, and a ball that presses it down.
void beam_over_block(scene::Simulation& s, bool beam_moves) {
  model::Model beam = block(8, 2, 1, {-8, 6, 8.4});
  for (model::Node& node : beam.nodes)
    if (node.position.x < -7)
      node.fixed = model::fixed_all;
  const model::Model below = block(5, 5, 2, {}, true);
  if (beam_moves) {
    add_static(s, "below", below);
    add(s, "beam", beam);
  } else {
    add(s, "below", below);
    add_static(s, "beam", beam);
  }
  s.apply(scene::SetContact{0, 1, 0.2});
  s.apply(scene::SetTimestep{h});
}

TEST(MixedMeetings, AnInstrumentPressesOneOnAnother) {
  for (const bool beam_moves : {false, true})
    for (const bool led : {false, true}) {
      scene::Simulation s(one_thread(), {});
      beam_over_block(s, beam_moves);
      s.apply(scene::SetInstrument{0, ball_of(3), {{14, 10, 15.4}, {}}, "ball"});
      if (led)
        s.apply(scene::SetCoupling{0, contact::Coupling{1e5, 10}});
      for (int k = 0; k < 60; ++k) {
        if (k < 45)
          s.apply(scene::MoveInstrument{0, Vec3{14, 10, 15.4 - 0.04 * (k + 1)}, {}, h});
        s.step(h);
        EXPECT_GT(least_gap(s, 0, 1), 0) << k;
        const Vec3 on_ball = s.instrument(0).force;
        EXPECT_GE(on_ball.z, -1e-9 * norm(on_ball)) << k;
        EXPECT_LE(norm(sum_of_forces(s, 0) + sum_of_forces(s, 1) + on_ball), 1e-11 * norm(on_ball))
            << k;
      }
      for (int k = 0; k < 60; ++k)
        s.step(h);
      const scene::InstrumentReport ball = s.instrument(0);
      EXPECT_GT(ball.force.z, 0) << beam_moves << led;
      EXPECT_LT(sum_of_forces(s, 0).z, 0) << beam_moves << led;
      EXPECT_LE(miss_of_balance(s, beam_moves ? 0 : 1, {}), balance_met);
      if (led) { // at rest the spring bears what presses
        EXPECT_NEAR(1e5 * (ball.pose.place.z - ball.hand->z), ball.force.z, 1e-2 * ball.force.z);
      }
    }
}

/// What lets go is as it was.
TEST(MixedMeetings, WhatComesApartIsAsItWas) {
  scene::Simulation s(one_thread(), {});
  const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 8.3});
  add_static(s, "below", block(5, 5, 2, {}, true));
  add(s, "above", above);
  s.apply(scene::SetContact{0, 1, 0.3});
  s.apply(scene::SetTimestep{h});
  const std::vector<std::uint32_t> lowest = nodes_below(above, 9);
  s.apply(scene::SetForce{1, lowest, {0, 0, -20000}});
  for (int k = 0; k < 30; ++k)
    s.step(1.0 / 60);
  EXPECT_LT(sum_of_forces(s, 0).z, 0);
  s.apply(scene::SetForce{1, lowest, {0, 0, 20000}});
  for (int k = 0; k < 30; ++k)
    s.step(1.0 / 60);
  EXPECT_TRUE(s.contact_forces(0).empty());
  for (const double u : s.displacement(0))
    EXPECT_EQ(u, 0);
}

/// Of three in a row the midst hands on what presses it, whoever moves.
TEST(MixedMeetings, ThreeInARow) {
  for (const unsigned moving : {1U, 2U, 4U, 3U, 5U, 6U}) {
    scene::Simulation s(one_thread(), {});
    model::Model middle = block(3, 3, 1, {3.7, 4.1, 8.02});
    for (model::Node& node : middle.nodes)
      if (node.position.x < 4)
        node.fixed = model::fixed_x | model::fixed_y;
    middle.nodes[0].fixed = model::fixed_all;
    const model::Model above = hanging(2, 2, 2, {5.9, 6.3, 12.1});
    const std::vector<model::Model> all{block(5, 5, 2, {}, true), middle, above};
    for (std::size_t k = 0; k < 3; ++k)
      if ((moving >> k & 1U) != 0)
        add(s, "block-" + std::to_string(k), all[k]);
      else
        add_static(s, "block-" + std::to_string(k), all[k]);
    s.apply(scene::SetContact{1, 0, 0});
    s.apply(scene::SetContact{2, 1, 0});
    s.apply(scene::SetTimestep{h});
    const std::vector<std::uint32_t> lowest = nodes_below(above, 13);
    for (int k = 1; k <= 120; ++k) {
      s.apply(scene::SetForce{2, lowest, {0, 0, -30.0 * k}});
      s.step(h);
      const Vec3 sum = sum_of_forces(s, 0) + sum_of_forces(s, 1) + sum_of_forces(s, 2);
      EXPECT_LE(norm(sum), 1e-12 * (norm(sum_of_forces(s, 2)) + norm(sum_of_forces(s, 0))))
          << moving << " " << k;
      EXPECT_GT(least_gap(s, 0, 1), 0) << moving << " " << k;
      EXPECT_GT(least_gap(s, 1, 2), 0) << moving << " " << k;
    }
    EXPECT_GT(sum_of_forces(s, 2).z, 0) << moving;
    EXPECT_LT(sum_of_forces(s, 0).z, 0) << moving;
  }
}

/// What fails is taken back, and what comes behind is as if it had not been, on any number of
/// threads.
TEST(MixedMeetings, WhatFailsIsTakenBack) {
  std::vector<std::vector<double>> shapes;
  for (const bool fails : {true, false})
    for (const int threads : {1, 2}) {
      Context context = one_thread();
      context.threads = threads;
      scene::Simulation s(context, {.guard = true});
      falls_on(s, {3.7, 4.1, 8.3}, 0.3);
      s.apply(scene::SetInstrument{0, ball_of(3), {{1, 1, 11.2}, {}}, "ball"});
      for (int k = 1; k <= 40; ++k) {
        s.apply(scene::MoveInstrument{0, Vec3{1, 1, 11.2 - 0.02 * k}, {}, h});
        if (k == 30 && fails) {
          s.apply(scene::SetForce{1, {0}, {1e39, 0, 0}}); // which is noticed in the step
          EXPECT_THROW(s.step(h), Error);
          s.apply(scene::Release{1, {0}});
        }
        s.step(h);
      }
      EXPECT_GT(s.instrument(0).force.z, 0);
      EXPECT_FALSE(s.contact_forces(1).empty());
      for (const std::size_t object : {0U, 1U})
        shapes.push_back(shape(s, object));
    }
  for (std::size_t k = 2; k < shapes.size(); ++k)
    EXPECT_EQ(shapes[k], shapes[k % 2]) << k;
}

/// A load that jumps leads an elastostatic object over a gap that nobody took for near.
TEST(MixedMeetings, WhoComesLateIsMet) {
  scene::Simulation s(one_thread(), {});
  const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 12});
  add(s, "below", block(5, 5, 2, {}, true));
  add_static(s, "above", above);
  s.apply(scene::SetContact{0, 1, 0});
  s.step(h);
  std::vector<std::uint32_t> lowest = nodes_below(above, 13);
  s.apply(scene::SetDisplacement{1, lowest, {0, 0, -5}});
  s.step(h);
  EXPECT_LT(sum_of_forces(s, 0).z, 0);
  EXPECT_GT(least_gap(s, 0, 1), 0);
  for (const std::uint32_t node : lowest)
    EXPECT_EQ(s.displacement(1)[3 * std::size_t{node} + 2], -5);
}

/// In the course of a step of the scene, in many steps of what moves: the mean of what presses is
/// about half of what presses at the end.
TEST(MixedMeetings, LoadsGoTheirWay) {
  scene::Simulation s(one_thread(), {});
  const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 8.02});
  add(s, "below", block(5, 5, 2, {}, true));
  add_static(s, "above", above);
  s.apply(scene::SetContact{0, 1, 0});
  s.apply(scene::SetTimestep{h});
  s.step(0.1);
  s.apply(scene::SetDisplacement{1, nodes_below(above, 9), {0, 0, -0.5}});
  s.step(0.1);
  const double mean = -sum_of_forces(s, 0).z;
  s.step(0.1);
  const double end = -sum_of_forces(s, 0).z;
  EXPECT_GT(end, 0);
  EXPECT_NEAR(mean, 0.5 * end, 0.15 * end);
}

/// An object that the model holds altogether is an obstacle, whatever its method.
TEST(MixedMeetings, WhatIsHeldAltogetherIsAnObstacle) {
  for (const bool floor_moves : {false, true})
    for (const bool above_moves : {false, true}) {
      scene::Simulation s(one_thread(), {});
      model::Model floor = block(5, 5, 2, {}, true);
      for (model::Node& node : floor.nodes)
        node.fixed = model::fixed_all;
      const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 8.1});
      if (floor_moves)
        add(s, "floor", floor);
      else
        add_static(s, "floor", floor);
      if (above_moves)
        add(s, "above", above);
      else
        add_static(s, "above", above);
      s.apply(scene::SetContact{0, 1, 0});
      s.apply(scene::SetGravity{{0, 0, -9810}});
      s.apply(scene::SetForce{1, nodes_below(above, 9), {0, 0, -20000}});
      for (int k = 0; k < 40; ++k) {
        s.step(1.0 / 60);
        EXPECT_GT(least_gap(s, 0, 1), 0) << k;
      }
      const Vec3 up = sum_of_forces(s, 1);
      EXPECT_GT(up.z, 0) << floor_moves << above_moves;
      EXPECT_LE(norm(up + sum_of_forces(s, 0)), 1e-12 * norm(up));
      EXPECT_LE(least_gap(s, 0, 1), gap_allowed);
      for (const double u : s.displacement(0))
        EXPECT_EQ(u, 0);
    }
}

} // namespace
} // namespace gewebe::test
