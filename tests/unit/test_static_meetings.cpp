// Elastostatic objects whose surfaces touch: what answers say must meet the conditions of contact,
// judged by other means than those that found them.

#include "base/context.h"
#include "base/error.h"
#include "compliance/compliance_source.h"
#include "contact/parameters.h"
#include "fem/model_stiffness.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "static_blocks.h"
#include "statics/elastostatic.h"
#include "statics/two_step.h"
#include "touching_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace gewebe::test {
namespace {

using namespace test;

/// Part of the largest displacement to which shapes and forces agree: the forces at each vertex
/// balance to force_tolerance of the largest one, which is but a tenth of what presses a face of
/// ten or more vertices. With friction also its last change, all around the edge of a face alike.
constexpr contact::Parameters contact_parameters;
constexpr double balance_met = 1e-5 + 0.1 * contact_parameters.tolerances.force;
constexpr double friction_met =
    contact_parameters.tolerances.friction + 2 * contact_parameters.tolerances.force;

Vec3 torque_of_forces(const scene::Simulation& s, std::size_t object) {
  Vec3 sum;
  for (const contact::NodeVector& f : s.contact_forces(object))
    sum += cross(s.model(object).nodes[f.node].position + vector_at(s.displacement(object), f.node),
                 f.value);
  return sum;
}

/// All that has to hold of two objects that touch, the forces on the second leading up.
void expect_contact(const scene::Simulation& s, const contact::Load& lower,
                    const contact::Load& upper, double friction) {
  const Vec3 down = sum_of_forces(s, 0), up = sum_of_forces(s, 1);
  EXPECT_GT(up.z, 0);
  EXPECT_LE(norm(up + down), 1e-12 * norm(up));
  EXPECT_LE(norm(torque_of_forces(s, 0) + torque_of_forces(s, 1)), 1e-2 * block_edge * norm(up));
  EXPECT_LE(least_gap(s, 0, 1), gap_allowed);
  const double met = friction > 0 ? friction_met : balance_met;
  EXPECT_LE(miss_of_balance(s, 0, lower), met);
  EXPECT_LE(miss_of_balance(s, 1, upper), met);
  // Of flat faces that hardly turn.
  for (const contact::NodeVector& f : s.contact_forces(1))
    EXPECT_GE(f.value.z, -1e-9 * norm(up));
  EXPECT_LE(std::hypot(up.x, up.y), (friction + 0.1) * up.z);
}

TEST(StaticMeetings, BlocksPressEachOther) {
  for (const double friction : {0.0, 0.4}) {
    scene::Simulation s(one_thread(), {});
    const model::Model below = block(5, 5, 2, {}, true), above = hanging(3, 3, 2, {3.7, 4.1, 8.3});
    add_static(s, "below", below);
    add_static(s, "above", above);
    s.apply(scene::SetContact{0, 1, friction});
    s.step(0.1);
    EXPECT_TRUE(s.contact_forces(0).empty());
    contact::Load push;
    const std::vector<std::uint32_t> lowest = nodes_below(above, 9);
    for (int k = 1; k <= 5; ++k) {
      for (const std::uint32_t node : lowest)
        push.force[node] = {5000.0 * k, 0, -20000.0 * k};
      s.apply(scene::SetForce{1, lowest, {5000.0 * k, 0, -20000.0 * k}});
      s.step(0.1);
      if (k > 1)
        expect_contact(s, {}, push, friction);
    }
    // What lets go is as it was.
    s.apply(scene::Release{1, lowest});
    s.step(0.1);
    for (std::size_t object : {0U, 1U})
      for (const double u : s.displacement(object))
        EXPECT_EQ(u, 0);
    EXPECT_TRUE(s.contact_forces(0).empty());
  }
}

/// Under loads that make no dent to speak of: the wall of one holds, too.
TEST(StaticMeetings, FrictionHoldsWhatWouldSlide) {
  std::vector<double> way;
  for (const double friction : {0.0, 0.2, 2.0}) {
    scene::Simulation s(one_thread(), {});
    const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 8.1});
    add_static(s, "below", block(5, 5, 2, {}, true));
    add_static(s, "above", above);
    s.apply(scene::SetContact{0, 1, friction});
    const std::vector<std::uint32_t> lowest = nodes_below(above, 9);
    s.apply(scene::SetForce{1, lowest, {0, 0, -6000}});
    s.step(0.1);
    const double before = s.displacement(1)[3 * std::size_t{lowest[0]}];
    s.apply(scene::SetForce{1, lowest, {1200, 0, -6000}});
    s.step(0.1);
    way.push_back(s.displacement(1)[3 * std::size_t{lowest[0]}] - before);
    const Vec3 up = sum_of_forces(s, 1);
    EXPECT_LE(std::hypot(up.x, up.y), friction * up.z + 1e-2 * up.z);
    EXPECT_LE(up.x, 1e-2 * up.z); // against the way
  }
  EXPECT_GT(way[0], 1.05 * way[1]);
  EXPECT_GT(way[1], 1.5 * way[2]);
}

TEST(StaticMeetings, FarApartNothingIsDifferent) {
  const auto shapes = [](bool may_touch) {
    return shapes_far_apart(add_static, {5000, 0, -20000}, may_touch);
  };
  EXPECT_EQ(shapes(false), shapes(true));
}

/// What would pass another object in one step is held where it would enter.
TEST(StaticMeetings, NothingJumpsThrough) {
  scene::Simulation s(one_thread(), {});
  const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 10.5});
  add_static(s, "below", block(5, 5, 2, {}, true));
  add_static(s, "above", above);
  s.apply(scene::SetContact{0, 1, 0});
  s.step(0.1);
  contact::Load push;
  const std::vector<std::uint32_t> lowest = nodes_below(above, 11);
  for (const std::uint32_t node : lowest)
    push.force[node] = {0, 0, -100000};
  statics::Elastostatic alone(above, nullptr, one_thread());
  alone.update(push);
  ASSERT_LT(alone.displacement()[3 * std::size_t{lowest[0]} + 2], -3);
  s.apply(scene::SetForce{1, lowest, {0, 0, -100000}});
  s.step(0.1);
  const Vec3 up = sum_of_forces(s, 1);
  EXPECT_GT(up.z, 0);
  EXPECT_LE(norm(up + sum_of_forces(s, 0)), 1e-12 * norm(up));
  EXPECT_GT(least_gap(s, 0, 1), 0);
  EXPECT_LE(miss_of_balance(s, 1, push), balance_met);
}

TEST(StaticMeetings, AnInstrumentPressesOneOnAnother) {
  scene::Simulation s(one_thread(), {});
  // A beam that is held at one end over a block.
  model::Model beam = block(8, 2, 1, {-8, 6, 8.4});
  for (model::Node& node : beam.nodes)
    if (node.position.x < -7)
      node.fixed = model::fixed_all;
  add_static(s, "below", block(5, 5, 2, {}, true));
  add_static(s, "beam", beam);
  s.apply(scene::SetContact{0, 1, 0.2});
  s.apply(scene::SetInstrument{0, ball_of(3), {{14, 10, 15.4}, {}}, "ball"});
  for (int k = 0; k < 15; ++k) {
    s.apply(scene::MoveInstrument{0, Vec3{14, 10, 15.4 - 0.1 * (k + 1)}, {}, 0.05});
    s.step(0.05);
    EXPECT_GT(least_gap(s, 0, 1), 0) << k;
  }
  const Vec3 on_ball = s.instrument(0).force, on_block = sum_of_forces(s, 0);
  EXPECT_GT(on_ball.z, 0);
  EXPECT_LT(on_block.z, 0);
  EXPECT_LE(norm(sum_of_forces(s, 1) + on_ball + on_block), 1e-12 * norm(on_ball));
  EXPECT_LE(miss_of_balance(s, 0, {}), friction_met);
  EXPECT_LE(miss_of_balance(s, 1, {}), 10 * friction_met); // it bends by a difference of forces
}

/// The shape of two steps is what both stages say of the forces that are told.
TEST(StaticMeetings, StagesOfTwoStepsAreMet) {
  for (const double threshold : {1e30, 1e5}) {
    scene::Simulation s(one_thread(), {});
    const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 8.1});
    add_static(s, "below", block(5, 5, 2, {}, true));
    add_static(s, "above", above);
    const auto second = [&] {
      model::Model stiffer = above;
      for (model::Material& m : stiffer.materials)
        m.young *= 4;
      return stiffer;
    }();
    const statics::TwoStepOptions options{.threshold = threshold};
    s.apply(scene::SetTwoStep{1, options, {}, std::make_shared<const model::Model>(second)});
    s.apply(scene::SetContact{0, 1, 0});
    const std::vector<std::uint32_t> lowest = nodes_below(above, 9);
    for (int k = 1; k <= 3; ++k) {
      contact::Load push;
      for (const std::uint32_t node : lowest)
        push.force[node] = {0, 0, -20000.0 * k};
      s.apply(scene::SetForce{1, lowest, {0, 0, -20000.0 * k}});
      s.step(0.1);
      EXPECT_GT(least_gap(s, 0, 1), 0);
      const Vec3 up = sum_of_forces(s, 1);
      EXPECT_GT(up.z, 0);
      EXPECT_LE(norm(up + sum_of_forces(s, 0)), 1e-12 * norm(up));
      EXPECT_LE(miss_of_balance(s, 0, {}), balance_met);
      for (const contact::NodeVector& f : s.contact_forces(1))
        push.force[f.node] += f.value;
      statics::Elastostatic first(above, nullptr, one_thread());
      statics::TwoStep both(above, compliance::compliance_of_factor([&] {
                              return linalg::Factor(fem::stiffness_matrix(second), one_thread());
                            }),
                            one_thread(), options);
      both.update(first, push);
      const std::span<const double> u = both.displacement(first);
      double miss = 0, largest = 0;
      for (std::size_t i = 0; i < u.size(); ++i) {
        miss = numeric::larger(miss, std::abs(u[i] - s.displacement(1)[i]));
        largest = numeric::larger(largest, std::abs(u[i]));
      }
      EXPECT_LE(miss, balance_met * largest);
    }
  }
}

/// Two arms along x, half an element apart, held at one end.
model::Model fork() {
  model::Model model = block(6, 2, 1, {});
  const model::Model other = block(6, 2, 1, {0, 0, 1.5 * block_edge});
  const auto first = static_cast<std::uint32_t>(model.nodes.size());
  model.nodes.insert(model.nodes.end(), other.nodes.begin(), other.nodes.end());
  for (Triangle t : other.triangles) {
    for (std::uint32_t& corner : t)
      corner += first;
    model.triangles.push_back(t);
  }
  for (Tetrahedron t : other.tetrahedra) {
    for (std::uint32_t& corner : t)
      corner += first;
    model.tetrahedra.push_back(t);
    model.tetrahedron_material.push_back(0);
  }
  for (model::Node& node : model.nodes)
    if (node.position.x == 0)
      node.fixed = model::fixed_all;
  return model;
}

TEST(StaticMeetings, TheArmsOfAForkTouch) {
  for (const bool meets : {true, false}) {
    scene::Simulation s(one_thread(), {});
    const model::Model model = fork();
    add_static(s, "fork", model);
    if (meets)
      s.apply(scene::SetContact{0, 0, 0.3});
    std::vector<std::uint32_t> upper;
    contact::Load push;
    for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
      if (model.nodes[i].position.z == 2.5 * block_edge) {
        upper.push_back(i);
        push.force[i] = {0, 0, -400};
      }
    s.apply(scene::SetForce{0, upper, {0, 0, -400}});
    for (int k = 0; k < 3; ++k)
      s.step(0.1);
    if (meets) {
      EXPECT_LE(least_gap(s, 0, 0), gap_allowed);
      EXPECT_FALSE(s.contact_forces(0).empty());
      EXPECT_LE(norm(sum_of_forces(s, 0)), 1e-8);
      EXPECT_LE(miss_of_balance(s, 0, push), friction_met);
    } else {
      EXPECT_LT(least_gap(s, 0, 0), 0) << "they pass each other where nobody says otherwise";
    }
  }
}

/// What fails is taken back to the last bit, and what comes behind is as if it had not been.
TEST(StaticMeetings, WhatFailsIsTakenBack) {
  std::vector<std::vector<double>> shapes;
  for (const bool fails : {true, false}) {
    scene::Simulation s(one_thread(), {.guard = true});
    const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 8.3});
    add_static(s, "below", block(5, 5, 2, {}, true));
    add_static(s, "above", above);
    s.apply(scene::SetContact{0, 1, 0.3});
    s.apply(scene::SetInstrument{0, ball_of(3), {{1, 1, 11.2}, {}}, "ball"});
    const std::vector<std::uint32_t> lowest = nodes_below(above, 9);
    for (int k = 1; k <= 4; ++k) {
      s.apply(scene::SetForce{1, lowest, {3000.0 * k, 0, -20000.0 * k}});
      s.apply(scene::MoveInstrument{0, Vec3{1, 1, 11.2 - 0.2 * k}, {}, 0.1});
      if (fails && k == 3) {
        s.apply(scene::SetForce{1, {lowest[0]}, {1e15, 0, 0}}); // which is noticed when it is found
        EXPECT_THROW(s.step(0.1), Error);
        s.apply(scene::SetForce{1, lowest, {3000.0 * k, 0, -20000.0 * k}});
      }
      s.step(0.1);
    }
    EXPECT_GT(s.instrument(0).force.z, 0);
    EXPECT_FALSE(s.contact_forces(0).empty());
    for (const std::size_t object : {0U, 1U})
      shapes.push_back(shape(s, object));
  }
  EXPECT_EQ(shapes[0], shapes[2]);
  EXPECT_EQ(shapes[1], shapes[3]);
}

TEST(StaticMeetings, WhatIsDisplacedPresses) {
  scene::Simulation s(one_thread(), {});
  const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 8.1});
  add_static(s, "below", block(5, 5, 2, {}, true));
  add_static(s, "above", above);
  s.apply(scene::SetContact{0, 1, 0});
  std::vector<std::uint32_t> middle;
  contact::Load load;
  for (std::uint32_t i = 0; i < above.nodes.size(); ++i)
    if (std::abs(above.nodes[i].position.z - 12.1) < 1e-9) {
      middle.push_back(i);
      load.displacement[i] = {0.2, 0, -1};
    }
  s.apply(scene::SetDisplacement{1, middle, {0.2, 0, -1}});
  s.step(0.1);
  const Vec3 down = sum_of_forces(s, 0);
  EXPECT_LT(down.z, 0);
  EXPECT_LE(least_gap(s, 0, 1), gap_allowed);
  EXPECT_LE(miss_of_balance(s, 0, {}), balance_met);
  EXPECT_LE(miss_of_balance(s, 1, load), balance_met);
  for (const std::uint32_t i : middle)
    EXPECT_EQ(vector_at(s.displacement(1), i), Vec3(0.2, 0, -1));
  s.apply(scene::Release{1, middle});
  s.step(0.1);
  EXPECT_TRUE(s.contact_forces(0).empty());
  for (const double u : s.displacement(1))
    EXPECT_EQ(u, 0);
}

/// Of three in a row, who is in the midst hands on what presses it.
TEST(StaticMeetings, ThreeInARow) {
  scene::Simulation s(one_thread(), {});
  model::Model middle = block(3, 3, 1, {3.7, 4.1, 8.2});
  for (model::Node& node : middle.nodes)
    if (node.position.x < 4)
      node.fixed = model::fixed_x | model::fixed_y;
  middle.nodes[0].fixed = model::fixed_all;
  const model::Model above = hanging(2, 2, 2, {5.9, 6.3, 12.5});
  add_static(s, "below", block(5, 5, 2, {}, true));
  add_static(s, "middle", middle);
  add_static(s, "above", above);
  s.apply(scene::SetContact{1, 0, 0});
  s.apply(scene::SetContact{2, 1, 0});
  const std::vector<std::uint32_t> lowest = nodes_below(above, 13);
  for (int k = 1; k <= 4; ++k) {
    s.apply(scene::SetForce{2, lowest, {0, 0, -30000.0 * k}});
    s.step(0.1);
  }
  EXPECT_GT(sum_of_forces(s, 2).z, 0);
  EXPECT_LT(sum_of_forces(s, 0).z, 0);
  EXPECT_LE(norm(sum_of_forces(s, 0) + sum_of_forces(s, 1) + sum_of_forces(s, 2)),
            1e-12 * norm(sum_of_forces(s, 2)));
  EXPECT_GT(least_gap(s, 0, 1), 0);
  EXPECT_GT(least_gap(s, 1, 2), 0);
}

/// A hand's instrument gives way to both that it presses together.
TEST(StaticMeetings, ALedInstrumentFeelsBoth) {
  scene::Simulation s(one_thread(), {});
  model::Model beam = block(8, 2, 1, {-8, 6, 8.4});
  for (model::Node& node : beam.nodes)
    if (node.position.x < -7)
      node.fixed = model::fixed_all;
  add_static(s, "below", block(5, 5, 2, {}, true));
  add_static(s, "beam", beam);
  s.apply(scene::SetContact{0, 1, 0.2});
  s.apply(scene::SetInstrument{0, ball_of(3), {{14, 10, 15.5}, {}}, "ball"});
  s.apply(scene::SetCoupling{0, contact::Coupling{1e5, 10}});
  for (int k = 0; k < 60; ++k) {
    if (k < 40)
      s.apply(scene::MoveInstrument{0, Vec3{14, 10, 15.5 - 0.05 * (k + 1)}, {}, 0.01});
    s.step(0.01);
    EXPECT_GT(least_gap(s, 0, 1), 0) << k;
  }
  const scene::InstrumentReport ball = s.instrument(0);
  ASSERT_TRUE(ball.hand);
  EXPECT_GT(ball.force.z, 1e4);
  // At rest the spring bears what presses.
  EXPECT_NEAR(1e5 * (ball.pose.place.z - ball.hand->z), ball.force.z, 1e-3 * ball.force.z);
  EXPECT_LE(norm(sum_of_forces(s, 0) + sum_of_forces(s, 1) + ball.force), 1e-12 * norm(ball.force));
}

} // namespace
} // namespace gewebe::test
