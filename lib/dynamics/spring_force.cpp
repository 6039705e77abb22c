#include "dynamics/spring_force.h"

#include "base/error.h"
#include "dynamics/spring_kernel.h"

#include <cmath>
#include <string>

namespace gewebe::dynamics {

SpringNetwork spring_network(const model::Model& model) {
  const std::size_t n = model.nodes.size();
  SpringNetwork network;
  network.position.reserve(n);
  network.drag.reserve(n);
  for (const model::Node& node : model.nodes) {
    network.position.push_back(node.position);
    network.drag.push_back(node.drag);
  }
  network.first.assign(n + 1, 0);
  for (const model::Spring& s : model.springs) {
    ++network.first[s.i + std::size_t{1}];
    ++network.first[s.j + std::size_t{1}];
  }
  for (std::size_t i = 0; i < n; ++i)
    network.first[i + 1] += network.first[i];
  network.halves.resize(network.first[n]);
  std::vector<std::size_t> next(network.first.begin(), network.first.end() - 1);
  for (const model::Spring& s : model.springs) {
    network.halves[next[s.i]++] = {s.j, s.stiffness, s.damping, s.rest};
    network.halves[next[s.j]++] = {s.i, s.stiffness, s.damping, s.rest};
  }
  return network;
}

void require_masses(const model::Model& model) {
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    if (const model::Node& node = model.nodes[i];
        node.fixed != model::fixed_all && !(node.mass > 0))
      throw Error("node " + std::to_string(i) +
                  " can move but has no mass, expected more than 0 g");
}

Vec3 spring_force(const SpringNetwork& network, std::span<const NodeMotion> motion, std::size_t i) {
  const Vec3 position = network.position[i];
  const NodeMotion own = motion[i];
  Vec3 force;
  for (std::size_t h = network.first[i]; h < network.first[i + 1]; ++h) {
    const SpringNetwork::Half& half = network.halves[h];
    const NodeMotion& other = motion[half.other];
    // Differences, products and sums of them: seen from the other end all signs are opposite.
    const Vec3 along =
        (network.position[half.other] - position) + (other.displacement - own.displacement);
    const double square = dot(along, along);
    if (!(square > min_square))
      continue;
    const double length = std::sqrt(square);
    const double pull = half.stiffness * (length - half.rest) * length +
                        half.damping * dot(other.velocity - own.velocity, along);
    force += pull * (1 / square) * along;
  }
  return force - network.drag[i] * own.velocity;
}

double kinetic_energy(const model::Model& model, std::span<const NodeMotion> motion) {
  double sum = 0;
  for (std::size_t i = 0; i < motion.size(); ++i)
    sum += model.nodes[i].mass * dot(motion[i].velocity, motion[i].velocity) / 2;
  return sum;
}

double elastic_energy(const model::Model& model, std::span<const NodeMotion> motion) {
  double sum = 0;
  for (const model::Spring& s : model.springs) {
    const Vec3 along = (model.nodes[s.j].position - model.nodes[s.i].position) +
                       (motion[s.j].displacement - motion[s.i].displacement);
    const double extension = norm(along) - s.rest;
    sum += s.stiffness * extension * extension / 2;
  }
  return sum;
}

Vec3 momentum(const model::Model& model, std::span<const NodeMotion> motion) {
  Vec3 sum;
  for (std::size_t i = 0; i < motion.size(); ++i)
    sum += model.nodes[i].mass * motion[i].velocity;
  return sum;
}

} // namespace gewebe::dynamics
