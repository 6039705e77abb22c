#pragma once
// What the tests of scenes have in common: shapes as vectors, and cuts of an organ.

#include "cutting/cut_select.h"
#include "scene/simulation.h"
#include "sim_models.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <gtest/gtest.h>
#include <span>
#include <vector>

namespace gewebe::test {

inline std::vector<double> shape(const scene::Simulation& s, std::size_t object) {
  const std::span<const double> u = s.displacement(object);
  return {u.begin(), u.end()};
}

/// Until it rests.
inline void settle(scene::Simulation& s) {
  std::uint64_t before = 0;
  for (int k = 0; k < 400; ++k) {
    s.step(0.1);
    if (k > 0 && s.counts().integration == before)
      return;
    before = s.counts().integration;
  }
  ADD_FAILURE() << "it doesn't come to rest";
}

/// An organ whose upper part hangs on springs of the surface alone once it is cut.
inline model::Model soft_organ() {
  model::Model model = organ(3);
  for (std::size_t i = model::surface_count(model); i < model.nodes.size(); ++i)
    model.nodes[i].fixed = model::fixed_none;
  return model;
}

/// Cuts through the top of an organ.
inline scene::CutObject lobe_off(std::size_t object = 0) {
  return {object, scene::PlaneToCut{{{100, -50, 41}, {0, 0, 1}}, {}}};
}

inline std::uint32_t highest(const model::Model& model) {
  std::uint32_t top = 0;
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
    if (model.nodes[i].position.z > model.nodes[top].position.z)
      top = i;
  return top;
}

inline std::size_t count(const scene::Simulation& s, scene::Cutting::Kind kind) {
  return static_cast<std::size_t>(
      std::count_if(s.news().cuttings.begin(), s.news().cuttings.end(),
                    [&](const scene::Cutting& c) { return c.kind == kind; }));
}

/// Nodes in a band over the top: a plane through them is an incision.
inline scene::PlaneToCut incision(const model::Model& model) {
  scene::PlaneToCut cut{{{100.2, -50, 30}, {1, 0.1, 0}}, std::vector<std::uint32_t>{}};
  for (std::uint32_t i = 0; i < model::surface_count(model); ++i)
    if (model.nodes[i].position.z > 40)
      cut.nodes->push_back(i);
  return cut;
}

/// All springs of this node but one, an edge.
inline scene::SpringsToCut all_but_one(const model::Model& model, std::uint32_t node) {
  std::vector<std::uint32_t> others;
  bool kept = false;
  for (const model::Spring& spring : model.springs)
    if (spring.i == node || spring.j == node) {
      if (kept)
        others.push_back(spring.i == node ? spring.j : spring.i);
      kept = true; // an edge, for these come first
    }
  std::sort(others.begin(), others.end());
  return {{node}, others};
}

/// A ball of springs along edges alone that is held below.
inline model::Model shell() {
  model::BuildOptions options;
  options.bend = true;
  options.centrals = 0;
  model::Model model = model::build_model(ball(1, 10), options, Context{}).model;
  for (model::Node& n : model.nodes)
    n.fixed = n.position.z < 0 ? model::fixed_all : model::fixed_none;
  return model;
}

} // namespace gewebe::test
