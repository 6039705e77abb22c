#include "sim/elastodynamic.h"

#include "base/error.h"
#include "base/parallel.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

// Based on: E. Hairer, C. Lubich, G. Wanner, Geometric numerical integration illustrated by the
// Störmer-Verlet method, 2003 (symplectic Euler).

namespace gewebe {

namespace {

constexpr double rest_tolerance = 1e-14;
constexpr double most_steps = 1e9;
constexpr std::size_t grain = 1024;            // nodes of a block
constexpr std::size_t parallel_halves = 60000; // below, threads cost more than they gain

/// Whether every component is at most `bound` in size; false for NaN.
bool within(const Vec3& v, double bound) {
  return std::abs(v.x) <= bound && std::abs(v.y) <= bound && std::abs(v.z) <= bound;
}

Vec3 times(const Vec3& a, const Vec3& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}

} // namespace

Elastodynamic::Elastodynamic(const Model& model)
    : model_(model), network_(spring_network(model)), motion_(model.nodes.size()),
      next_(model.nodes.size()) {
  Box3 box;
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    const Node& node = model.nodes[i];
    box.add(node.position);
    if (node.fixed != fixed_all && !(node.mass > 0))
      throw Error("node " + std::to_string(i) +
                  " can move but has no mass, expected more than 0 g");
  }
  size_ = box.longest_side();
  apply_load();
}

void Elastodynamic::set_load(const Load& load) {
  if (load == load_)
    return;
  load_ = load;
  apply_load();
}

void Elastodynamic::apply_load() {
  const std::size_t n = model_.nodes.size();
  inverse_mass_.assign(n, {});
  constant_.assign(n, {});
  for (std::size_t i = 0; i < n; ++i) {
    const Node& node = model_.nodes[i];
    for (int a = 0; a < 3; ++a)
      inverse_mass_[i][a] = is_fixed(model_, i, a) ? 0 : 1 / node.mass;
    constant_[i] = node.mass * load_.gravity;
  }
  for (const auto& [node, force] : load_.force)
    constant_[node] += force;
  for (const auto& [node, displacement] : load_.displacement) {
    inverse_mass_[node] = {};
    motion_[node] = {displacement, {}};
  }
  resting_ = false;
}

void Elastodynamic::set_motion(std::vector<NodeMotion> motion) {
  motion_ = std::move(motion);
  apply_load();
}

bool Elastodynamic::found_at_rest(double h) const {
  const double speed = rest_tolerance * size_ / h, acceleration = speed / h;
  for (const NodeMotion& m : motion_)
    if (!within(m.velocity, speed))
      return false;
  for (std::size_t i = 0; i < motion_.size(); ++i) {
    if (inverse_mass_[i] == Vec3{})
      continue;
    const Vec3 force = spring_force(network_, motion_, i) + constant_[i];
    if (!within(times(force, inverse_mass_[i]), acceleration))
      return false;
  }
  return true;
}

std::uint64_t Elastodynamic::advance(double duration, double largest_step, const Context& context) {
  if (resting_ || duration == 0)
    return 0;
  // A hair more than a whole number of steps is rounding.
  const double exact = duration / largest_step * (1 - 1e-12);
  if (!(exact <= most_steps))
    throw Error("a step of this length takes over 1e9 integration steps, expected fewer");
  const double count = std::max(1.0, std::ceil(exact));
  const double h = duration / count;
  if (found_at_rest(h)) {
    for (NodeMotion& m : motion_)
      m.velocity = {};
    resting_ = true;
    return 0;
  }
  const auto steps = static_cast<std::uint64_t>(count);
  Context quiet = context;
  quiet.progress = nullptr; // steps are short
  if (network_.halves.size() < parallel_halves)
    quiet.threads = 1;
  for (std::uint64_t s = 0; s < steps; ++s)
    if (!step(h, quiet))
      throw Error("the motion is no longer finite after " + std::to_string(s + 1) + " of " +
                  std::to_string(steps) +
                  " integration steps, expected a smaller load or timestep");
  return steps;
}

bool Elastodynamic::step(double h, const Context& context) {
  std::atomic<bool> finite{true};
  parallel_blocks(context, motion_.size(), grain, [&](std::size_t begin, std::size_t end) {
    double sum = 0; // not finite if any part is not
    for (std::size_t i = begin; i < end; ++i) {
      NodeMotion m = motion_[i];
      if (inverse_mass_[i] != Vec3{}) {
        const Vec3 force = spring_force(network_, motion_, i) + constant_[i];
        m.velocity += h * times(force, inverse_mass_[i]);
        m.displacement += h * m.velocity;
      }
      sum += std::abs(m.displacement.x) + std::abs(m.displacement.y) + std::abs(m.displacement.z);
      next_[i] = m;
    }
    if (!std::isfinite(sum))
      finite.store(false, std::memory_order_relaxed);
  });
  std::swap(motion_, next_);
  return finite.load();
}

std::vector<NodeVector> Elastodynamic::contact_forces() const {
  std::vector<NodeVector> forces;
  forces.reserve(load_.displacement.size());
  for (const auto& [node, displacement] : load_.displacement) {
    Vec3 force = -(spring_force(network_, motion_, node) + constant_[node]);
    for (int a = 0; a < 3; ++a)
      if (is_fixed(model_, node, a) || force[a] == 0)
        force[a] = 0; // no -0
    forces.push_back({node, force});
  }
  return forces;
}

} // namespace gewebe
