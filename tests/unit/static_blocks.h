#pragma once
// Elastostatic blocks whose surfaces touch in scenes, and what tests ask of them.

#include "base/context.h"
#include "base/vector_at.h"
#include "contact/instrument.h"
#include "larger.h"
#include "scene/simulation.h"
#include "sim_models.h"
#include "statics/elastostatic.h"
#include "touching_blocks.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gewebe::test {

inline void add_static(Simulation& s, const std::string& name, const Model& model) {
  s.add_object(name, model, Method::ffe);
}

inline InstrumentShape ball_of(double radius) {
  InstrumentShape shape;
  shape.radius = radius;
  return shape;
}

/// A block that is held at its top.
inline Model hanging(std::uint32_t nx, std::uint32_t ny, std::uint32_t nz, const Vec3& corner) {
  Model model = block(nx, ny, nz, corner);
  for (Node& node : model.nodes)
    if (node.position.z > corner.z + (nz - 0.5) * block_edge)
      node.fixed = fixed_all;
  return model;
}

inline std::vector<std::uint32_t> nodes_below(const Model& model, double z) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < model.nodes.size(); ++i)
    if (model.nodes[i].position.z < z)
      all.push_back(i);
  return all;
}

/// How far the shape is from what K says of a load and the forces that are told, over the largest.
inline double miss_of_balance(const Simulation& s, std::size_t object, Load load) {
  for (const NodeVector& f : s.contact_forces(object))
    load.force[f.node] += f.value;
  Elastostatic own(s.model(object), nullptr, one_thread());
  own.update(load);
  const std::span<const double> u = own.displacement();
  double miss = 0, largest = 0;
  for (std::size_t k = 0; k < u.size(); ++k) {
    miss = larger(miss, std::abs(u[k] - s.displacement(object)[k]));
    largest = larger(largest, std::abs(u[k]));
  }
  return miss / largest;
}

} // namespace gewebe::test
