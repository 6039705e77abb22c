#pragma once
// Elastostatic blocks whose surfaces touch in scenes, and what tests ask of them.

#include "base/context.h"
#include "contact/instrument.h"
#include "geometry/vector_at.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "simulation_scenes.h"
#include "statics/elastostatic.h"
#include "touching_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gewebe::test {

inline void add_static(scene::Simulation& s, const std::string& name, const model::Model& model) {
  s.add_object(name, model, scene::Method::ffe);
}

inline contact::InstrumentShape ball_of(double radius) {
  contact::InstrumentShape shape;
  shape.radius = radius;
  return shape;
}

/// A block that is held at its top.
inline model::Model hanging(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz,
                            const Vec3& corner) {
  model::Model model = block(nx, ny, nz, corner);
  for (model::Node& node : model.nodes)
    if (node.position.z > corner.z + (nz - 0.5) * block_edge)
      node.fixed = model::fixed_all;
  return model;
}

inline std::vector<std::uint32_t> nodes_below(const model::Model& model, double z) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (model.nodes[i].position.z < z)
      all.push_back(i);
  return all;
}

/// How far the shape is from what K says of a load and the forces that are told, over the largest.
inline double miss_of_balance(const scene::Simulation& s, std::size_t object, contact::Load load) {
  for (const contact::NodeVector& f : s.contact_forces(object))
    load.force[f.node] += f.value;
  statics::Elastostatic own(s.model(object), nullptr, one_thread());
  own.update(load);
  const std::span<const double> u = own.displacement();
  double miss = 0, largest = 0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    miss = numeric::larger(miss, std::abs(u[k] - s.displacement(object)[k]));
    largest = numeric::larger(largest, std::abs(u[k]));
  }
  return miss / largest;
}

/// What becomes of an elastostatic block under a ball and of one 32 mm above it, which is added so
/// and pulled down by its lowest nodes.
inline std::vector<std::vector<double>>
shapes_far_apart(void (*add_above)(scene::Simulation&, const std::string&, const model::Model&),
                 const Vec3& force, bool may_touch) {
  scene::Simulation s(one_thread(), {});
  const model::Model above = hanging(3, 3, 2, {3.7, 4.1, 40});
  add_static(s, "below", block(5, 5, 2, {}, true));
  add_above(s, "above", above);
  if (may_touch)
    s.apply(scene::SetContact{0, 1, 0.3});
  s.apply(scene::SetForce{1, nodes_below(above, 41), force});
  s.apply(scene::SetInstrument{0, ball_of(3), {{9, 9, 12}, {}}, "ball"});
  for (int k = 0; k < 4; ++k) {
    s.apply(scene::MoveInstrument{0, Vec3{9, 9, 11.0 - k}, {}, 0.1});
    s.step(0.1);
  }
  EXPECT_GT(s.instrument(0).force.z, 0);
  return {shape(s, 0), shape(s, 1)};
}

} // namespace gewebe::test
