// Blocks that are thrown at a wall, by up to many times their own length within a step: none gets
// beyond it, none leaves it with more than it had.

#include "geometry/vector_at.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "touching_blocks.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::test {
namespace {

using namespace test;

constexpr double step = 1.0 / 60, size = 2 * block_edge, gravity = 9810;

double mass_of(const scene::Simulation& s, std::size_t object) {
  return weight_of(s, object) / gravity;
}

/// Of its middle.
Vec3 place_of(const scene::Simulation& s, std::size_t object) {
  Vec3 sum;
  const std::vector<double> u = shape(s, object);
  for (std::size_t i = 0; i < s.model(object).nodes.size(); ++i) {
    const model::Node& n = s.model(object).nodes[i];
    sum += n.mass * (n.position + vector_at(u, i));
  }
  return sum / mass_of(s, object);
}

/// Of both, times their mass.
Vec3 centre_of(const scene::Simulation& s) {
  return mass_of(s, 0) * place_of(s, 0) + mass_of(s, 1) * place_of(s, 1);
}

/// Of motion, elements and weight.
double energy(const scene::Simulation& s, double weight) {
  const scene::SimulationState state = s.state();
  double sum = state.kinetic_energy + state.elastic_energy;
  for (const std::size_t k : {0U, 1U})
    sum += weight * mass_of(s, k) * place_of(s, k).z;
  return sum;
}

/// How deep the node that is deepest in another object's elements is, over an edge.
double depth_inside(const scene::Simulation& s, std::size_t nodes, std::size_t elements) {
  const model::Model& wall = s.model(elements);
  const std::vector<double> u = shape(s, elements), own = shape(s, nodes);
  std::vector<Vec3> at;
  for (std::size_t i = 0; i < wall.nodes.size(); ++i)
    at.push_back(wall.nodes[i].position + vector_at(u, i));
  double most = 0;
  for (std::size_t i = 0; i < s.model(nodes).nodes.size(); ++i) {
    const Vec3 p = s.model(nodes).nodes[i].position + vector_at(own, i);
    for (const Tetrahedron& t : wall.tetrahedra) {
      double least = HUGE_VAL;
      for (std::size_t k = 0; k < 4; ++k) { // from each of its faces
        const Vec3 &a = at[t[(k + 1) % 4]], &b = at[t[(k + 2) % 4]], &c = at[t[(k + 3) % 4]];
        const Vec3 n = cross(b - a, c - a);
        const double side = dot(n, at[t[k]] - a) < 0 ? -1 : 1;
        least = numeric::smaller(least, side * dot(n, p - a) / norm(n));
      }
      most = numeric::larger(most, least);
    }
  }
  return most / block_edge;
}

/// Two blocks, the second one above the first, that come together at so many of its sizes a step:
/// first they are less than one step apart.
void throw_block(scene::Simulation& s, double sizes, double friction, bool held) {
  const double way = sizes * size;
  model::Model below = block(6, 6, 1, {}, held),
               above = block(2, 2, 2, {7.3, 8.1, block_edge + 0.3 + 1.4 * way});
  for (model::Model* const m : {&below, &above})
    for (model::Node& n : m->nodes)
      n.drag = 0;
  add(s, "below", below);
  add(s, "above", above);
  s.apply(scene::SetContact{0, 1, friction});
  s.apply(scene::SetTimestep{step});
  for (std::uint32_t i = 0; i < above.nodes.size(); ++i)
    s.apply(scene::SetForce{1, {i}, {0, 0, -way / step / step * above.nodes[i].mass}});
  s.step(step);
  s.apply(scene::Release{1, nodes_of(above)});
}

class Impacts : public testing::TestWithParam<double> {};

TEST_P(Impacts, NoBlockGetsBeyondAWall) {
  const double sizes = GetParam();
  for (const bool held : {true, false}) {
    scene::Simulation s(one_thread(), {});
    throw_block(s, sizes, held ? 0.2 : 0, held);
    if (held)
      s.apply(scene::SetGravity{{0, 0, -gravity}});
    const double weight = held ? gravity : 0;
    const double thrown = mass_of(s, 1) * std::pow(sizes * size / step, 2) / 2;
    double least = energy(s, weight), pushed = 0;
    std::array<Vec3, 3> way; // of the middle of each in the last step, and of both
    std::array<Vec3, 3> at{place_of(s, 0), place_of(s, 1), centre_of(s)};
    for (int k = 0; k < 8; ++k) {
      s.step(step);
      const Vec3 force = sum_of_forces(s, 1);
      pushed = numeric::larger(pushed, norm(force));
      EXPECT_LE(norm(force + sum_of_forces(s, 0)), 1e-12 * pushed) << k;
      // Forces are right to 1e-4 of an edge, and act on in parts of a step.
      const double now = energy(s, weight);
      EXPECT_LE(now, least + 1e-3 * thrown + 2e-4 * block_edge * norm(force)) << k;
      least = numeric::smaller(least, now);
      EXPECT_LE(numeric::larger(depth_inside(s, 1, 0), depth_inside(s, 0, 1)), 1e-3) << k;
      const Vec3 going = way[2];
      const std::array<Vec3, 3> there{place_of(s, 0), place_of(s, 1), centre_of(s)};
      for (std::size_t i = 0; i < 3; ++i)
        way[i] = there[i] - at[i];
      at = there;
      EXPECT_GT(at[1].z, at[0].z) << k;
      if (!held && k > 0) {
        EXPECT_LE(norm(way[2] - going), 1e-9 * norm(going)) << k;
      }
    }
    EXPECT_GT(pushed, 0);
    if (!held) {
      EXPECT_GE(way[1].z, way[0].z - 1e-2 * sizes * size) << "they part, or go on as one";
    }
  }
}

/// A force throws it from rest, farther in one step than it was from the wall: none of its speeds
/// told so when the step began.
TEST(SimulationImpacts, WhatIsPulledFromRestIsStoppedToo) {
  for (const double sizes : {0.5, 3.0, 10.0}) {
    scene::Simulation s(one_thread(), {});
    const double way = sizes * size;
    add(s, "below", block(6, 6, 1, {}, true));
    const model::Model above = block(2, 2, 2, {7.3, 8.1, block_edge + 0.3 + 0.5 * way});
    add(s, "above", above);
    s.apply(scene::SetContact{0, 1, 0.2});
    s.apply(scene::SetTimestep{step});
    for (std::uint32_t i = 0; i < above.nodes.size(); ++i)
      s.apply(scene::SetForce{1, {i}, {0, 0, -way / step / step * above.nodes[i].mass}});
    s.step(step);
    EXPECT_GT(place_of(s, 1).z, place_of(s, 0).z);
    EXPECT_LE(numeric::larger(depth_inside(s, 1, 0), depth_inside(s, 0, 1)), 1e-3);
  }
}

/// An instrument that is moved at once pushes two blocks out of its way: they leave no speed behind
/// but what their shapes give back.
TEST(SimulationImpacts, WhatIsInTheWayOfAnInstrumentMovedAtOnceGoesOn) {
  scene::Simulation s(one_thread(), {});
  add(s, "one", block(2, 1, 1, {}));
  add(s, "other", block(2, 1, 1, {0, 4.05, 0}));
  s.apply(scene::SetContact{0, 1, 0});
  scene::SetInstrument ball;
  ball.shape.radius = 4;
  ball.pose.place = {4, 4, -5};
  s.apply(ball);
  s.step(1e-4);
  constexpr double way = 14;
  s.apply(scene::MoveInstrument{0, {4, 4, -5 + way}, {}, 0});
  s.step(1e-4);
  EXPECT_GT(least_gap(s, 0, 1), 0);
  for (const std::size_t k : {0U, 1U}) {
    EXPECT_LT(surface_depth(s.model(k), shape(s, k), s.instrument(0).shape, s.instrument(0).pose),
              depth_allowed);
    for (const double u : shape(s, k))
      EXPECT_LE(std::abs(u), 2 * way);
  }
}

INSTANTIATE_TEST_SUITE_P(SizesAStep, Impacts, testing::Values(0.1, 0.5, 1, 2, 5, 10));

} // namespace
} // namespace gewebe::test
