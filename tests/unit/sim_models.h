#pragma once
// Models for the tests of the simulation.

#include "base/context.h"
#include "dynamics/spring_force.h"
#include "model/build.h"
#include "model_meshes.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::test {

inline Context one_thread() {
  Context context;
  context.threads = 1;
  return context;
}

/// Two masses on one spring of length 2 along x.
inline Model two_masses(double mass = 1, double stiffness = 1, double damping = 0,
                        double drag = 0) {
  Model m;
  m.name = "two";
  m.materials.resize(1);
  m.materials[0].name = "m";
  for (const double x : {-1.0, 1.0}) {
    Node n;
    n.position = {x, 0, 0};
    n.mass = mass;
    n.drag = drag;
    m.nodes.push_back(n);
  }
  m.springs = {{0, 1, SpringKind::edge, stiffness, damping, 2}};
  return m;
}

/// A ball on fixed central nodes, with some nodes held below.
inline Model organ(int rounds = 2, bool bend = true) {
  BuildOptions options;
  options.bend = bend;
  Model model = build_model(ball(rounds, 20, {100, -50, 30}), options, Context{}).model;
  for (std::size_t i = 0; i < surface_count(model); ++i)
    if (model.nodes[i].position.z < 14)
      model.nodes[i].fixed = i % 3 == 0 ? fixed_z : fixed_all;
  return model;
}

/// The nodes of the surface that no axis holds.
inline std::vector<std::uint32_t> free_nodes(const Model& model) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < surface_count(model); ++i)
    if (model.nodes[i].fixed == fixed_none)
      nodes.push_back(i);
  return nodes;
}

} // namespace gewebe::test
