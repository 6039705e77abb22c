#pragma once
// Forces of a model of masses and springs, and their conserved quantities (report 3.1.3).
//
// With e = l - rest and n from i to j, a spring pulls node i by [k e + c (v_j - v_i)·n] n and node
// j by exactly the opposite, bit for bit. Drag brakes a node by -d v. A spring whose ends coincide
// (within 1e-150 mm) has no direction and exerts no force.

#include "geometry/vec3.h"
#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::dynamics {

/// Displacement from rest (mm) and velocity (mm/s) of a node. Displacements instead of positions
/// keep the digits of small deformations far from the origin.
struct NodeMotion {
  Vec3 displacement, velocity;
};

/// Springs of a model, by node. Those of node i are halves[first[i] … first[i+1]), in the model's
/// order.
struct SpringNetwork {
  struct Half {
    std::uint32_t other = 0;
    double stiffness = 0, damping = 0, rest = 0;
  };
  std::vector<std::size_t> first;
  std::vector<Half> halves;
  std::vector<Vec3> position; ///< at rest
  std::vector<double> drag;
};

/// \pre check_model(model) passes
SpringNetwork spring_network(const model::Model& model);

/// \throw Error that names the first node that can move and has no mass
void require_masses(const model::Model& model);

/// Force of springs and drag on node i. \pre as many motions as nodes
Vec3 spring_force(const SpringNetwork& network, std::span<const NodeMotion> motion, std::size_t i);

/// Σ m v²/2 and Σ k e²/2, in g mm²/s² = 1e-9 J.
double kinetic_energy(const model::Model& model, std::span<const NodeMotion> motion);
double elastic_energy(const model::Model& model, std::span<const NodeMotion> motion);

/// Σ m v, in g mm/s.
Vec3 momentum(const model::Model& model, std::span<const NodeMotion> motion);

} // namespace gewebe::dynamics
