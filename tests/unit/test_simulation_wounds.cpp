// Scenes in which the walls of wounds touch: instruments, each other, what lies around.

#include "base/error.h"
#include "contact/convex_core.h"
#include "contact_checks.h"
#include "convex_meshes.h"
#include "cut_bars.h"
#include "fem/solid_model.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "simulation_scenes.h"
#include "tet_fixtures.h"
#include "touching_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace gewebe::test {
namespace {

using namespace test;

/// By node: the normal at rest that points into the object, as long as the area around.
std::vector<Vec3> inward_directions(const model::Model& model) {
  std::vector<Vec3> inward(model.nodes.size());
  for (const Triangle& t : model.triangles) {
    const Vec3 a = model.nodes[t[0]].position, b = model.nodes[t[1]].position,
               c = model.nodes[t[2]].position;
    for (const std::uint32_t corner : t)
      inward[corner] -= cross(b - a, c - a);
  }
  return inward;
}

/// The two copies of each node of a wound at rest: that on the side of lower x first.
std::vector<std::array<std::uint32_t, 2>> copies(const model::Model& model) {
  std::map<std::tuple<double, double, double>, std::uint32_t> at;
  std::vector<std::array<std::uint32_t, 2>> all;
  const std::vector<Vec3> inward = inward_directions(model);
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i) {
    const Vec3& p = model.nodes[i].position;
    const auto [there, fresh] = at.try_emplace({p.x, p.y, p.z}, i);
    if (fresh)
      continue;
    all.push_back({there->second, i});
    if (inward[there->second].x > inward[i].x)
      std::swap(all.back()[0], all.back()[1]);
  }
  return all;
}

Vec3 place(const scene::Simulation& s, std::size_t object, std::uint32_t node) {
  return s.model(object).nodes[node].position + vector_at(shape(s, object), node);
}

/// Pulled (or, below 0, pressed) at its end.
void pull(scene::Simulation& s, std::size_t object, double force) {
  const std::vector<std::uint32_t> end =
      nodes_where(s.model(object), [](const Vec3& p) { return p.x == 20; });
  for (const std::uint32_t node : end)
    s.apply(scene::SetForce{object, {node}, {force / static_cast<double>(end.size()), 0, 0}});
}

/// How far the end has moved along the bar, in the mean.
double end_moved(const scene::Simulation& s, std::size_t object) {
  const std::vector<double> u = shape(s, object);
  const auto end = nodes_where(s.model(object), [](const Vec3& p) { return p.x == 20; });
  double sum = 0;
  for (const std::uint32_t node : end)
    sum += u[3 * std::size_t{node}] / static_cast<double>(end.size());
  return sum;
}

// ---- instruments

enum class Tool { sphere, capsule, mesh };

scene::SetInstrument tool(Tool kind, double friction) {
  scene::SetInstrument set;
  set.name = "tool";
  set.shape.radius = 0.3; // elements are of 2.5
  set.shape.friction = friction;
  if (kind == Tool::capsule)
    set.shape.axis = {0, 0, 6};
  if (kind == Tool::mesh) {
    set.shape.radius = 0.05;
    set.shape.core = std::make_shared<const contact::ConvexCore>(divided_box({0.2, 1.5, 4}, 1));
  }
  return set;
}

void expect_pushed_wall(const scene::Simulation& s, bool sphere, double friction) {
  const model::Model& model = s.model(0);
  const scene::InstrumentReport report = s.instrument(0);
  const std::vector<contact::NodeVector>& forces = s.contact_forces(0);
  EXPECT_GE(forces.size(), 3U);
  std::vector<std::uint32_t> left;
  for (const auto& pair : copies(model))
    left.push_back(pair[0]);
  const std::vector<Vec3> inward = inward_directions(model);
  Vec3 sum;
  double sizes = 0;
  for (const contact::NodeVector& f : forces) {
    EXPECT_TRUE(std::ranges::find(left, f.node) != left.end()) << f.node;
    EXPECT_GT(dot(f.value, inward[f.node]), 0) << "it pulls at " << f.node;
    sum += f.value;
    sizes += norm(f.value);
  }
  EXPECT_LE(norm(sum + report.force), 1e-12 * norm(sum));
  EXPECT_LE(test::surface_depth(model, shape(s, 0), report.shape, report.pose),
            test::depth_allowed);
  if (sphere) { // a point of it has no other arm
    EXPECT_LE(norm(report.torque), (friction + 1e-7) * report.shape.radius * sizes);
  }
}

class ToolsInWounds : public testing::TestWithParam<std::tuple<bool, scene::Method>> {};
INSTANTIATE_TEST_SUITE_P(Solids, ToolsInWounds,
                         testing::Combine(testing::Bool(),
                                          testing::Values(scene::Method::ffe, scene::Method::ela)));

TEST_P(ToolsInWounds, PushTheWallThatTheyArePressedOn) {
  const auto [quadratic, method] = GetParam();
  for (const Tool kind : {Tool::sphere, Tool::capsule, Tool::mesh})
    for (const double friction : {0.0, 0.4}) {
      if (quadratic && (kind == Tool::mesh || (kind == Tool::sphere) == (friction == 0)))
        continue;
      SCOPED_TRACE(std::to_string(static_cast<int>(kind)) + " " + std::to_string(friction));
      scene::Simulation s(one_thread(), {});
      s.add_object("bar", bar(quadratic), method);
      s.apply(notch(s.model(0), 9.9));
      pull(s, 0, 5e5);
      for (int k = 0; k < (method == scene::Method::ela ? 40 : 1); ++k)
        s.step(1.0 / 60);
      double least = HUGE_VAL;
      Vec3 middle, across;
      for (const auto& [left, right] : copies(s.model(0)))
        if (const double off = norm(s.model(0).nodes[left].position - Vec3{9.2, 5, 7.5});
            off < least) {
          least = off;
          across = place(s, 0, right) - place(s, 0, left);
          middle = place(s, 0, left) + 0.5 * across;
        }
      ASSERT_GT(across.x, 2) << "it opens";
      scene::SetInstrument set = tool(kind, friction);
      set.pose.place = middle + Vec3{0, 0.2, 0};
      s.apply(set);
      s.step(1.0 / 60);
      EXPECT_TRUE(s.contact_forces(0).empty());
      s.apply(
          scene::MoveInstrument{0, middle + Vec3{-0.5 * norm(across) - 0.3, 0.4, -0.2}, {}, 0.1});
      for (int k = 0; k < 10; ++k)
        s.step(1.0 / 60);
      for (int k = 0; k < 4; ++k) {
        s.step(1.0 / 600); // a single step, whose forces are no means
        expect_pushed_wall(s, kind == Tool::sphere, friction);
      }
      if (kind != Tool::sphere) // which reach out of the wound
        continue;
      // Without the wound it would be inside: it enters from outside, and pushes the surface ahead.
      s.apply(scene::Restore{0});
      for (int k = 0; k < 2; ++k)
        s.step(1.0 / 600);
      Vec3 pushed;
      for (const contact::NodeVector& f : s.contact_forces(0))
        pushed += f.value;
      EXPECT_GT(norm(pushed), 0);
      EXPECT_LE(norm(pushed + s.instrument(0).force), 1e-9 * norm(pushed));
    }
}

// ---- walls

/// A bar as test::bar of larger elements, whose motion comes to rest.
model::Model short_bar(bool quadratic) {
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 20000, 1, 0.2, 0.3}};
  options.quadratic = quadratic;
  options.drag_rate = 40;
  model::Model model = fem::solid_model(box_tetrahedra(4, 2, 2, 5), options, {});
  for (model::Node& node : model.nodes)
    node.fixed = node.position.x == 0 ? model::fixed_all : model::fixed_none;
  return model;
}

const scene::PlaneToCut slanted{{{9.7, 5, 5}, {1, 0.1, 0.2}}, {}};

/// The least gap of a wound's nodes over the triangles of the other wall, straight.
double wall_gap(const scene::Simulation& s) {
  const model::Model& model = s.model(0);
  std::map<std::uint32_t, int> side;
  for (const auto& [left, right] : copies(model)) {
    side[left] = -1;
    side[right] = 1;
  }
  double least = HUGE_VAL;
  for (const Triangle& t : model.triangles) {
    const Vec3& rest = model.nodes[t[0]].position;
    const Vec3 n = cross(model.nodes[t[1]].position - rest, model.nodes[t[2]].position - rest);
    int which = 0;
    for (const std::uint32_t corner : t)
      which += side.contains(corner) ? side.at(corner) : 0;
    if (which == 0 || std::abs(n.x) < 0.9 * norm(n))
      continue;
    const Vec3 a = place(s, 0, t[0]), b = place(s, 0, t[1]) - a, c = place(s, 0, t[2]) - a;
    const Vec3 now = cross(b, c);
    for (const auto& [node, of] : side) {
      if (of * which > 0)
        continue;
      const Vec3 off = place(s, 0, node) - a;
      const double second = dot(cross(off, c), now) / dot(now, now),
                   third = dot(cross(b, off), now) / dot(now, now);
      if (second >= 0 && third >= 0 && second + third <= 1)
        least = numeric::smaller(least, dot(off, now) / norm(now));
    }
  }
  return least / 5;
}

class Wounds : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Orders, Wounds, testing::Bool());

TEST_P(Wounds, HalvesThatArePressedTogetherDoNotPass) {
  double whole = 0;
  for (const std::string how : {"whole", "touch", "pass"}) {
    scene::Simulation s(one_thread(), {});
    s.add_object("bar", short_bar(GetParam()), scene::Method::ela);
    if (how == "touch")
      s.apply(scene::SetContact{0, 0, 0.8});
    if (how != "whole")
      s.apply(scene::CutObject{0, slanted});
    const std::size_t last = s.object_count() - 1;
    ASSERT_EQ(last, how == "whole" ? 0U : 1U);
    pull(s, last, -1e5);
    for (int k = 0; k < (GetParam() ? 5 : 10); ++k) {
      s.step(1.0 / 60);
      if (how != "touch")
        continue;
      EXPECT_GT(least_gap(s, 0, 1), 0);
      const Vec3 one = sum_of_forces(s, 0);
      EXPECT_LE(norm(one + sum_of_forces(s, 1)), 1e-11 * norm(one));
    }
    const double moved = end_moved(s, last);
    if (how == "whole")
      whole = moved;
    else if (how == "touch") {
      EXPECT_NEAR(moved, whole, 0.05 * std::abs(whole)) << "as if it were one";
      EXPECT_NEAR(norm(sum_of_forces(s, 1)), 1e5, 1e3);
    } else {
      EXPECT_LT(moved, -10) << "through each other";
    }
  }
}

TEST_P(Wounds, WhatComesOffFallsOnWhatItsParentTouched) {
  for (const bool meets : {true, false}) {
    scene::Simulation s(one_thread(), {});
    s.add_object("bar", short_bar(GetParam()), scene::Method::ela);
    fem::SolidModelOptions options;
    options.material.materials = {{"gel", 1e-3, 2e4, 1, 0.2, 0.3}};
    options.quadratic = GetParam();
    model::Model plate = fem::solid_model(box_tetrahedra(4, 3, 1, 7), options, {});
    for (model::Node& node : plate.nodes) {
      node.fixed = node.position.z == 0 ? model::fixed_all : model::fixed_none;
      node.position += Vec3{-1, -6, -9};
    }
    s.add_object("plate", plate, scene::Method::ela);
    s.apply(scene::SetGravity{{0, 0, -9810}});
    if (meets)
      s.apply(scene::SetContact{0, 1, 0.8});
    s.step(0.01);
    s.apply(scene::CutObject{0, slanted});
    ASSERT_EQ(s.object_count(), 3U);
    double up = 0;
    for (int k = 0; k < 24; ++k) {
      s.step(1.0 / 60);
      if (!meets)
        continue;
      EXPECT_GT(least_gap(s, 1, 2), 0);
      const Vec3 force = sum_of_forces(s, 2);
      EXPECT_GE(force.z, 0);
      EXPECT_LE(norm(force + sum_of_forces(s, 1)), 1e-11 * norm(force));
      up += k < 12 ? 0 : force.z / 12;
    }
    if (meets)
      EXPECT_NEAR(up, weight_of(s, 2), 0.1 * weight_of(s, 2));
    else
      EXPECT_LT(shape(s, 2)[2], -50) << "it falls through";
  }
}

TEST(WoundScenes, ItsWallsDoNotPass) {
  double whole = 0;
  for (const std::string how : {"whole", "touch", "pass"}) {
    scene::Simulation s(one_thread(), {});
    s.add_object("bar", short_bar(false), scene::Method::ela);
    if (how == "touch")
      s.apply(scene::SetContact{0, 0, 0.8});
    if (how != "whole")
      s.apply(scene::CutObject{
          0, scene::PlaneToCut{slanted.plane,
                               nodes_where(s.model(0), [](const Vec3& p) { return p.z > 2; })}});
    ASSERT_EQ(s.object_count(), 1U);
    pull(s, 0, -1e5);
    for (int k = 0; k < 10; ++k)
      s.step(1.0 / 60);
    const double moved = end_moved(s, 0);
    if (how == "whole") {
      whole = moved;
    } else if (how == "touch") {
      EXPECT_NEAR(moved, whole, 0.1 * std::abs(whole)) << "closed, it is as if it were whole";
      EXPECT_GE(wall_gap(s), -1e-2);
      EXPECT_LE(norm(sum_of_forces(s, 0)), 1e-9 * 1e5) << "what it does to itself";
    } else {
      EXPECT_LT(moved, 1.5 * whole) << "it bends into itself";
    }
  }
}

/// Contact that is asked for after the cut, whose walls stand at one place then; they part by less
/// than a thousandth of an edge.
TEST(WoundScenes, WallsOfACutMadeBeforeContactBeginApart) {
  for (const scene::Method method : {scene::Method::ela, scene::Method::ffe})
    for (const bool through : {false, true}) {
      scene::Simulation s(one_thread(), {});
      s.add_object("bar", short_bar(false), method);
      s.apply(scene::CutObject{
          0, through ? slanted
                     : scene::PlaneToCut{slanted.plane, nodes_where(s.model(0), [](const Vec3& p) {
                                           return p.z > 2;
                                         })}});
      const std::size_t last = s.object_count() - 1;
      ASSERT_EQ(last, through ? 1U : 0U);
      s.apply(scene::SetContact{0, last, 0.8});
      pull(s, last, -1e4);
      for (int k = 0; k < 5; ++k) {
        s.step(1.0 / 60);
        if (through) {
          EXPECT_GT(least_gap(s, 0, 1), 0) << k;
        } else {
          EXPECT_GE(wall_gap(s), -1e-2) << k;
        }
      }
      EXPECT_FALSE(s.contact_forces(0).empty());
      if (through && method == scene::Method::ela) { // else one tells means over its step
        EXPECT_LE(norm(sum_of_forces(s, 0) + sum_of_forces(s, 1)),
                  1e-11 * norm(sum_of_forces(s, 0)));
      }
    }
}

/// Rounding puts the middles of edges of both sides of a cut at places that differ by a bit, where
/// the body has been bent.
TEST(WoundScenes, WallsOfAMovedQuadraticSolidBeginApart) {
  tetrahedra::TetMesh mesh = box_tetrahedra(4, 2, 2, 5);
  for (Vec3& p : mesh.points) { // turned, so that no coordinate is a round number
    p = {0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y, p.z};
    p = {p.x + 0.1, 0.28 * p.y - 0.96 * p.z, 0.96 * p.y + 0.28 * p.z};
  }
  fem::SolidModelOptions options;
  options.material.materials = {{"gel", 1e-3, 20000, 1, 0.2, 0.3}};
  options.quadratic = true;
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", fem::solid_model(mesh, options, {}), scene::Method::ela);
  s.apply(scene::SetContact{0, 0, 0.3});
  s.apply(scene::SetForce{0, {0}, {7e3, -2e3, 1e3}});
  for (int k = 0; k < 3; ++k)
    s.step(1.0 / 60);
  Vec3 middle;
  for (const model::Node& node : s.model(0).nodes)
    middle += node.position / static_cast<double>(s.model(0).nodes.size());
  s.apply(scene::CutObject{0, scene::PlaneToCut{{middle, {0.93, -0.31, 0.47}}, {}}});
  for (int k = 0; k < 3; ++k)
    s.step(1.0 / 60);
  ASSERT_EQ(s.object_count(), 2U);
  EXPECT_GT(least_gap(s, 0, 1), 0);
}

TEST(WoundScenes, WhatComesOffLiesOnItsParent) {
  for (const bool meets : {true, false}) {
    scene::Simulation s(one_thread(), {});
    model::Model held = block(3, 3, 3, {}, true);
    add(s, "block", held);
    s.apply(scene::SetGravity{{0, 0, -9810}});
    if (meets)
      s.apply(scene::SetContact{0, 0, 0.5});
    s.step(0.01);
    s.apply(scene::CutObject{0, scene::PlaneToCut{{{0, 0, 6.6}, {0.05, 0.02, 1}}, {}}});
    ASSERT_EQ(s.object_count(), 2U);
    for (int k = 0; k < 10; ++k) {
      s.step(1.0 / 60);
      if (meets) {
        EXPECT_GT(least_gap(s, 0, 1), 0);
      }
    }
    if (meets) {
      const Vec3 up = sum_of_forces(s, 1);
      EXPECT_NEAR(up.z, weight_of(s, 1), 0.1 * weight_of(s, 1));
      EXPECT_LE(norm(up + sum_of_forces(s, 0)), 1e-11 * norm(up));
    } else {
      EXPECT_LT(shape(s, 1)[2], -10) << "through its parent";
    }
  }
}

/// The part of an elastostatic object moves, and may touch what moves.
TEST(WoundScenes, WhatComesOffAnElastostaticObjectMayTouchWhatMoves) {
  scene::Simulation s(one_thread(), {});
  s.add_object("bar", short_bar(false), scene::Method::ffe);
  model::Model plate = block(8, 6, 1, {-4, -7, -9});
  for (model::Node& node : plate.nodes)
    node.fixed = node.position.z == -9 ? model::fixed_all : model::fixed_none;
  add(s, "plate", plate);
  s.apply(scene::SetGravity{{0, 0, -9810}});
  s.step(0.01);
  s.apply(scene::CutObject{0, slanted});
  ASSERT_EQ(s.object_count(), 3U);
  s.apply(scene::SetContact{2, 1, 0.8});
  for (int k = 0; k < 16; ++k) {
    s.step(1.0 / 60);
    EXPECT_GT(least_gap(s, 1, 2), 0);
  }
  EXPECT_GT(sum_of_forces(s, 2).z, 0.5 * weight_of(s, 2));
}

TEST(WoundScenes, RestoreTakesTheWallsOutOfContact) {
  scene::Simulation s(one_thread(), {}), never(one_thread(), {});
  for (scene::Simulation* const one : {&s, &never}) {
    one->add_object("bar", short_bar(false), scene::Method::ela);
    one->apply(scene::SetContact{0, 0, 0.3});
    pull(*one, 0, -1e5);
    one->step(1.0 / 60);
  }
  s.apply(scene::CutObject{
      0, scene::PlaneToCut{slanted.plane,
                           nodes_where(s.model(0), [](const Vec3& p) { return p.z > 2; })}});
  for (int k = 0; k < 4; ++k)
    s.step(1.0 / 60);
  EXPECT_FALSE(s.contact_forces(0).empty());
  s.apply(scene::Restore{0});
  EXPECT_EQ(s.model(0), never.model(0));
  for (int k = 0; k < 20; ++k)
    s.step(1.0 / 60);
  EXPECT_TRUE(s.contact_forces(0).empty());
  for (int k = 0; k < 24; ++k)
    never.step(1.0 / 60);
  EXPECT_NEAR(end_moved(s, 0), end_moved(never, 0), 0.02 * std::abs(end_moved(never, 0)));
}

TEST(WoundScenes, AStepThatFailsLeavesTheSurfaceThatTouches) {
  const auto run = [](bool fails) {
    scene::Simulation s(one_thread(), {.guard = true});
    add(s, "block", block(3, 3, 3, {}, true));
    s.apply(scene::SetGravity{{0, 0, -9810}});
    s.apply(scene::SetContact{0, 0, 0.5});
    s.step(0.01);
    if (fails) {
      s.schedule(0.015, scene::CutObject{0, scene::PlaneToCut{{{0, 0, 6.6}, {0.05, 0.02, 1}}, {}}});
      s.schedule(0.018,
                 scene::CutObject{0, scene::PlaneToCut{{{0, 0, 500}, {0, 0, 1}}, {}}}); // misses
      EXPECT_THROW(s.step(0.01), Error);
      EXPECT_EQ(s.object_count(), 1U);
    }
    s.step_to(0.014);
    EXPECT_TRUE(s.contact_forces(0).empty());
    return shape(s, 0);
  };
  const std::vector<double> once = run(false), again = run(true);
  double most = 0;
  for (std::size_t k = 0; k < once.size(); ++k)
    most = numeric::larger(most, std::abs(once[k] - again[k]));
  EXPECT_LE(most, 1e-3 * block_edge); // what was learned is forgotten
}

} // namespace
} // namespace gewebe::test
