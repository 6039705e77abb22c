#include "contact/contact_energy.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>

namespace gewebe::contact {

namespace {

/// Force of a pair of weight 1 at half of d_hat is 1/4.33 of kappa d_hat^3.
constexpr double barrier_at_half = 4.33;

/// The next power of 4: the stiffness of the barrier stays from step to step while forces change
/// little, so that what it stores is given back.
double stepped(double force) {
  int exponent = 0;
  const double part = std::frexp(force, &exponent); // 0.5 <= part < 1
  if (part == 0.5)
    --exponent;
  return std::ldexp(1, exponent + (exponent % 2 != 0 ? 1 : 0));
}

} // namespace

ContactEnergy::ContactEnergy(const Island& island, const StepOptions& options,
                             std::span<const Vec3> begin)
    : island_(island), parameters_(options.parameters), begin_(begin),
      d_hat_(island.activation_distance),
      stick_(options.h > 0 ? options.parameters.lengths.stick_speed * options.h
                           : options.parameters.lengths.stick_length * island.edge) {
  for (std::size_t a = 0; a < island.friction.owners(); ++a)
    for (std::size_t b = 0; b < island.friction.owners(); ++b)
      rough_ = rough_ || (island.allowed.at(a, b) != 0 && island.friction.at(a, b) > 0);
}

double ContactEnergy::step_limit() const {
  return parameters_.tolerances.step * (rough_ ? std::min(d_hat_, stick_) : d_hat_);
}

void ContactEnergy::set_stiffness(double force) {
  typical_force_ = force;
  barrier_force_ = stepped(force);
  kappa_ = barrier_force_ / (barrier_at_half * d_hat_ * d_hat_ * d_hat_);
}

bool ContactEnergy::raise_stiffness(double force) {
  const double wanted = stepped(parameters_.stiffness.last_share * force);
  if (!(wanted > barrier_force_))
    return false;
  const double factor = std::min(wanted / barrier_force_, parameters_.stiffness.factor);
  barrier_force_ *= factor;
  kappa_ *= factor;
  return true;
}

void ContactEnergy::find_pairs(const collision::Candidates& candidates, std::span<const Vec3> x) {
  find_active_pairs(island_.surface, candidates, x, d_hat_, pairs_);
  for (ContactPair& pair : pairs_.pairs) {
    // The same force at the same part of d_hat, whatever d_min is.
    const double scale = d_hat_ * d_hat_ / barrier_range(d_hat_, pair.d_min);
    pair.weight *= scale * scale;
  }
}

double ContactEnergy::energy(std::span<const Vec3> x) const {
  return barrier_energy(pairs_, x, kappa_) + friction_energy(friction_, x, begin_, stick_);
}

double ContactEnergy::add_gradient(std::span<const Vec3> x, std::span<Vec3> gradient) const {
  const double barrier = add_barrier_gradient(pairs_, x, kappa_, gradient);
  return barrier + add_friction_gradient(friction_, x, begin_, stick_, gradient);
}

void ContactEnergy::assemble(std::span<const Vec3> x, HessianMode mode, CondensedSystem& system) {
  barrier_hessian(pairs_, x, kappa_, mode, blocks_);
  friction_hessian(friction_, x, begin_, stick_, mode, friction_blocks_);
  std::vector<std::uint32_t> active;
  for (const auto* const list : {&blocks_, &friction_blocks_})
    for (const HessianBlock& block : *list)
      active.insert(active.end(), block.vertex.begin(), block.vertex.begin() + block.count);
  std::ranges::sort(active);
  active.erase(std::ranges::unique(active).begin(), active.end());
  system.activate(active);
  system.clear_hessian();
  for (const auto* const list : {&blocks_, &friction_blocks_})
    for (const HessianBlock& block : *list)
      system.add_hessian(std::span(block.vertex).first(block.count),
                         std::span(block.entry).first(std::size_t{9} * block.count * block.count));
}

void ContactEnergy::advance_duals(std::span<const Vec3> x, std::span<const Vec3> to, double part) {
  contact::advance_duals(friction_, x, to, begin_, stick_, part);
}

void ContactEnergy::damp_lag(std::span<const FrictionPair> before) {
  const auto key = [](const FrictionPair& pair) { return std::pair(pair.count, pair.vertex); };
  std::map<std::pair<std::uint8_t, std::array<std::uint32_t, 4>>, double> forces;
  for (const FrictionPair& pair : before)
    forces[key(pair)] = pair.normal_force;
  for (FrictionPair& pair : friction_) {
    const auto found = forces.find(key(pair));
    const double part = (1 + (found == forces.end() ? 0 : found->second) / pair.normal_force) / 2;
    pair.normal_force *= part;
    pair.limit *= part;
  }
}

void ContactEnergy::lag(std::span<const Vec3> x, bool damped) {
  if (!rough_)
    return;
  const std::vector<FrictionPair> before = friction_;
  lag_friction(island_.surface, pairs_, x, kappa_, island_.friction, friction_);
  align_friction(island_.surface, x, begin_, parameters_.lengths.stick_per_approach, friction_);
  keep_duals(before, friction_);
  ++lags_;
  if (damped)
    damp_lag(before);
}

bool ContactEnergy::renew_lag(std::span<const Vec3> x, std::span<const std::uint32_t> vertices,
                              bool damped) {
  if (!rough_)
    return false;
  std::vector<Vec3> old(x.size()), now(x.size());
  (void)add_friction_gradient(friction_, x, begin_, stick_, old);
  std::vector<FrictionPair> before = friction_;
  lag(x, false);
  (void)add_friction_gradient(friction_, x, begin_, stick_, now);
  double change = 0, largest = 0;
  std::vector<std::array<Vec3, 4>> pair_forces;
  barrier_forces(pairs_, x, kappa_, pair_forces);
  for (const std::array<Vec3, 4>& forces : pair_forces)
    for (const Vec3& f : forces)
      largest = std::max(largest, norm(f));
  for (const std::uint32_t v : vertices)
    change = std::max(change, norm(now[v] - old[v]));
  friction_residual_ = largest > 0 ? change / largest : 0;
  if (friction_residual_ <= parameters_.tolerances.friction) {
    friction_ = std::move(before);
    return false;
  }
  if (damped)
    damp_lag(before);
  return true;
}

std::vector<std::uint32_t> ContactEnergy::friction_vertices() const {
  std::vector<std::uint32_t> all;
  for (const FrictionPair& pair : friction_)
    all.insert(all.end(), pair.vertex.begin(), pair.vertex.begin() + pair.count);
  return all;
}

std::vector<ContactForce> ContactEnergy::forces(std::span<const Vec3> x) const {
  std::map<std::pair<std::uint32_t, std::uint32_t>, ContactForce> all;
  const auto add = [&](const auto& pair, const std::array<gewebe::Vec3, 4>& forces, bool normal) {
    const std::vector<std::uint32_t>& owner = island_.surface.owner;
    const std::uint32_t one = owner[pair.vertex[0]];
    std::uint32_t other = one;
    for (std::size_t k = 1; k < pair.count; ++k)
      other = owner[pair.vertex[k]] != one ? owner[pair.vertex[k]] : other;
    for (std::size_t k = 0; k < pair.count; ++k) {
      const std::uint32_t v = pair.vertex[k], from = owner[v] == one ? other : one;
      ContactForce& f = all[{v, from}];
      f.vertex = v;
      f.from = from;
      (normal ? f.normal : f.friction) += forces[k];
    }
  };
  std::vector<std::array<Vec3, 4>> pair_forces;
  barrier_forces(pairs_, x, kappa_, pair_forces);
  for (std::size_t k = 0; k < pairs_.pairs.size(); ++k)
    add(pairs_.pairs[k], pair_forces[k], true);
  friction_forces(friction_, x, begin_, stick_, pair_forces);
  for (std::size_t k = 0; k < friction_.size(); ++k)
    add(friction_[k], pair_forces[k], false);
  std::vector<ContactForce> list;
  for (const auto& entry : all)
    if (entry.second.normal != Vec3{} || entry.second.friction != Vec3{})
      list.push_back(entry.second);
  return list;
}

} // namespace gewebe::contact
