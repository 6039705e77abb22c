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

inline std::vector<double> shape(const Simulation& s, std::size_t object) {
  const std::span<const double> u = s.displacement(object);
  return {u.begin(), u.end()};
}

/// Until it rests.
inline void settle(Simulation& s) {
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
inline Model soft_organ() {
  Model model = organ(3);
  for (std::size_t i = surface_count(model); i < model.nodes.size(); ++i)
    model.nodes[i].fixed = fixed_none;
  return model;
}

/// Cuts through the top of an organ.
inline CutObject lobe_off(std::size_t object = 0) {
  return {object, PlaneToCut{{{100, -50, 41}, {0, 0, 1}}, {}}};
}

inline std::uint32_t highest(const Model& model) {
  std::uint32_t top = 0;
  for (std::uint32_t i = 0; i < surface_count(model); ++i)
    if (model.nodes[i].position.z > model.nodes[top].position.z)
      top = i;
  return top;
}

inline std::size_t count(const Simulation& s, Cutting::Kind kind) {
  return static_cast<std::size_t>(std::count_if(s.news().cuttings.begin(), s.news().cuttings.end(),
                                                [&](const Cutting& c) { return c.kind == kind; }));
}

/// Nodes in a band over the top: a plane through them is an incision.
inline PlaneToCut incision(const Model& model) {
  PlaneToCut cut{{{100.2, -50, 30}, {1, 0.1, 0}}, std::vector<std::uint32_t>{}};
  for (std::uint32_t i = 0; i < surface_count(model); ++i)
    if (model.nodes[i].position.z > 40)
      cut.nodes->push_back(i);
  return cut;
}

/// All springs of this node but one, an edge.
inline SpringsToCut all_but_one(const Model& model, std::uint32_t node) {
  std::vector<std::uint32_t> others;
  bool kept = false;
  for (const Spring& spring : model.springs)
    if (spring.i == node || spring.j == node) {
      if (kept)
        others.push_back(spring.i == node ? spring.j : spring.i);
      kept = true; // an edge, for these come first
    }
  std::sort(others.begin(), others.end());
  return {{node}, others};
}

/// A ball of springs along edges alone that is held below.
inline Model shell() {
  BuildOptions options;
  options.bend = true;
  options.centrals = 0;
  Model model = build_model(ball(1, 10), options, Context{}).model;
  for (Node& n : model.nodes)
    n.fixed = n.position.z < 0 ? fixed_all : fixed_none;
  return model;
}

} // namespace gewebe::test
