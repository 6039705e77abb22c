#pragma once
// Nets that strain an integrator: sixteen kinds of bad, by seed.

#include "dynamics/elastodynamic.h"
#include "sim_models.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace gewebe::test {

/// Every node displaced and moving at random, except along fixed axes.
inline std::vector<dynamics::NodeMotion> kicked(const model::Model& model, double displacement,
                                                double speed) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<dynamics::NodeMotion> motion(model.nodes.size());
  for (std::size_t i = 0; i < motion.size(); ++i)
    for (int a = 0; a < 3; ++a) {
      const double x = displacement * u(random), v = speed * u(random);
      if (!contact::is_fixed(model, i, a)) {
        motion[i].displacement[a] = x;
        motion[i].velocity[a] = v;
      }
    }
  return motion;
}

/// Nets of random shape, stiffness, mass and damping, all in a box.
inline model::Model random_model(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(0, 1);
  const auto spread = [&](double decades) { return std::pow(10, decades * (u(random) - 0.5)); };
  constexpr std::array<double, 4> ratios{0, 0.1, 1, 3};
  const double ratio = ratios[seed % 4];
  model::Model m = two_masses();
  m.nodes.clear();
  m.springs.clear();
  const double flat = seed % 3 == 0 ? 1e-4 : 1; // slivers
  for (std::uint32_t i = 0; i < 30; ++i) {
    model::Node n;
    n.position = {u(random), u(random), flat * u(random)};
    n.mass = spread(seed % 2 == 0 ? 6 : 1);
    n.drag = 0.1 * n.mass * (seed % 5 == 0 ? 1 : 0);
    n.fixed = i < 3 ? model::fixed_all : i < 6 ? model::fixed_x : model::fixed_none;
    m.nodes.push_back(n);
  }
  for (std::uint32_t i = 0; i < 30; ++i)
    for (std::uint32_t j = i + 1; j < 30; ++j)
      if (u(random) < 0.2) {
        model::Spring s{i, j, model::SpringKind::edge, spread(seed % 2 == 1 ? 9 : 3), 0, 0};
        const double a = m.nodes[i].mass, b = m.nodes[j].mass;
        s.damping = 2 * ratio * std::sqrt(s.stiffness * a * (b / (a + b)));
        s.rest = norm(m.nodes[j].position - m.nodes[i].position);
        m.springs.push_back(s);
      }
  return m;
}

} // namespace gewebe::test
