#pragma once
// Models for the tests of the simulation.

#include "base/context.h"
#include "dynamics/body_motion.h"
#include "dynamics/spring_force.h"
#include "model/build.h"
#include "model_meshes.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace gewebe::test {

inline Context one_thread() {
  Context context;
  context.threads = 1;
  return context;
}

/// Two masses on one spring of length 2 along x.
inline model::Model two_masses(double mass = 1, double stiffness = 1, double damping = 0,
                               double drag = 0) {
  model::Model m;
  m.name = "two";
  m.materials.resize(1);
  m.materials[0].name = "m";
  for (const double x : {-1.0, 1.0}) {
    model::Node n;
    n.position = {x, 0, 0};
    n.mass = mass;
    n.drag = drag;
    m.nodes.push_back(n);
  }
  m.springs = {{0, 1, model::SpringKind::edge, stiffness, damping, 2}};
  return m;
}

/// A ball on fixed central nodes, with some nodes held below. Kept: its clusters take their time.
inline model::Model organ(int rounds = 2, bool bend = true) {
  static std::map<std::pair<int, bool>, model::Model> made;
  model::Model& model = made[{rounds, bend}];
  if (!model.nodes.empty())
    return model;
  model::BuildOptions options;
  options.bend = bend;
  model = model::build_model(ball(rounds, 20, {100, -50, 30}), options, Context{}).model;
  for (std::size_t i = 0; i < model::surface_count(model); ++i)
    if (model.nodes[i].position.z < 14)
      model.nodes[i].fixed = i % 3 == 0 ? model::fixed_z : model::fixed_all;
  return model;
}

/// Held nowhere, and braked by nothing but springs.
inline model::Model freed(model::Model model) {
  for (model::Node& n : model.nodes) {
    n.fixed = model::fixed_none;
    n.drag = 0;
  }
  return model;
}

inline model::Model damped_pair() {
  return two_masses(2, 50, 1, 0.4);
}
/// Where mass 1 of it, thrown apart, is at time 1 by steps of 1/n, against the analytic motion.
inline double error_of_damped_pair(dynamics::BodyMotion& object, int n) {
  const double mass = 2, stiffness = 50, damping = 1, drag = 0.4, v = 0.3;
  std::vector<dynamics::NodeMotion> motion(2);
  motion[0].velocity.x = -v;
  motion[1].velocity.x = v;
  object.set_motion(motion);
  (void)object.advance(1, 1.0 / n, one_thread(), 0);
  // x'' = -(2k/m) x - ((2c + d)/m) x'
  const double decay = (2 * damping + drag) / mass / 2;
  const double omega = std::sqrt(2 * stiffness / mass - decay * decay);
  return std::abs(object.motion()[1].displacement.x -
                  v / omega * std::exp(-decay) * std::sin(omega));
}

/// The nodes of the surface that no axis holds.
inline std::vector<std::uint32_t> free_nodes(const model::Model& model) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
    if (model.nodes[i].fixed == model::fixed_none)
      nodes.push_back(i);
  return nodes;
}

} // namespace gewebe::test
