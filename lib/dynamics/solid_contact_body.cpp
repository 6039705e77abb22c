#include "dynamics/solid_contact_body.h"

#include "geometry/vector_at.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace gewebe::dynamics {

using contact::Block3, contact::VertexForce;

void SolidContactBody::begin(double h, std::vector<VertexForce> last,
                             const contact::TypicalContact& typical, const Context& context) {
  h_ = h;
  context_ = context;
  last_ = std::move(last);
  typical_force_ = typical.force;
  double lightest = 0;
  for (const std::uint32_t node : vertices_)
    if (const double mass = motion_.masses()[node]; mass > 0)
      lightest = lightest > 0 ? std::min(lightest, mass) : mass;
  stiffness_ = typical.stiffness + lightest / (h * h);
  forces_.assign(axes_, 0);
  inner_factor_ = 1;
}

std::optional<contact::EnergyGain> SolidContactBody::energy_gain() {
  const integrator::StageEnergy energy = motion_.stage_energy(context_);
  return contact::EnergyGain{energy.gain, energy.inner, energy.scale};
}

void SolidContactBody::positions(std::span<Vec3> x) {
  const std::span<const double> at = motion_.iterate();
  for (std::size_t k = 0; k < vertices_.size(); ++k)
    x[k] = vector_at(at, vertices_[k]);
}

void SolidContactBody::spread(std::span<const VertexForce> forces) {
  forces_.assign(axes_, 0);
  for (const VertexForce& f : forces)
    for (std::size_t a = 0; a < 3; ++a)
      forces_[3 * std::size_t{vertices_[f.vertex]} + a] += f.force[static_cast<int>(a)];
}

double SolidContactBody::linearise(std::span<const VertexForce> forces, std::span<Vec3> step) {
  if (set_load_)
    set_load_();
  spread(forces);
  linearised_ = forces_;
  step_.resize(axes_);
  motion_.linearise_step(step_, forces_, context_);
  if (const std::uint64_t version = motion_.matrix_version(); version != columns_.version) {
    std::swap(columns_, others_);
    if (columns_.version != version)
      columns_ = {version, {}};
  }
  for (std::size_t k = 0; k < vertices_.size(); ++k)
    step[k] = vector_at(std::span<const double>(step_), vertices_[k]);
  if (!std::isfinite(h_)) {
    double most = 0;
    for (const double by : step_)
      most = std::max(most, std::abs(by));
    return typical_force_ * most;
  }
  double energy = 0; // of inertia alone
  for (std::size_t axis = 0; axis < axes_; ++axis)
    energy += motion_.masses()[axis / 3] * step_[axis] * step_[axis];
  return energy / (h_ * h_);
}

/// Drops columns beside those of `vertices`, where more would exceed a quarter of the memory.
void SolidContactBody::make_room(std::span<const std::uint32_t> vertices, std::size_t more) {
  const double each = 9 * sizeof(double) * static_cast<double>(vertices_.size());
  const auto bytes = [&](std::size_t others) {
    return each * static_cast<double>(columns_.of.size() + more + others);
  };
  const double room = static_cast<double>(context_.max_memory) / 4;
  if (!(bytes(others_.of.size()) > room))
    return;
  others_ = {};
  if (!(bytes(0) > room))
    return;
  std::erase_if(columns_.of, [&](const auto& one) {
    return std::ranges::find(vertices, one.first) == vertices.end();
  });
  if (bytes(0) > room)
    require_memory(context_, 4 * bytes(0), "the compliance of nodes in contact");
}

void SolidContactBody::prepare(std::span<const std::uint32_t> vertices) {
  constexpr std::size_t together = 8;
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t vertex : vertices)
    if (!columns_.of.contains(vertex))
      missing.push_back(vertex);
  make_room(vertices, missing.size());
  std::vector<double> whole;
  for (std::size_t first = 0; first < missing.size(); first += together) {
    const std::span<const std::uint32_t> batch =
        std::span(missing).subspan(first, std::min(together, missing.size() - first));
    std::vector<std::uint32_t> nodes;
    for (const std::uint32_t vertex : batch)
      nodes.push_back(vertices_[vertex]);
    whole.resize(3 * axes_ * nodes.size());
    motion_.unit_responses(nodes, whole);
    for (std::size_t k = 0; k < batch.size(); ++k) {
      std::vector<double>& kept = columns_.of[batch[k]];
      kept.reserve(9 * vertices_.size());
      for (const std::uint32_t node : vertices_)
        for (std::size_t a = 0; a < 3; ++a)
          for (std::size_t column = 0; column < 3; ++column)
            kept.push_back(whole[(3 * k + column) * axes_ + 3 * std::size_t{node} + a]);
    }
  }
}

void SolidContactBody::compliance(std::uint32_t vertex, std::span<const std::uint32_t> rows,
                                  std::span<Block3> blocks) {
  if (!columns_.of.contains(vertex))
    prepare({&vertex, 1});
  const std::vector<double>& column = columns_.of.at(vertex);
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (std::size_t a = 0; a < 9; ++a)
      blocks[k][a] = motion_.relaxation() * column[9 * std::size_t{rows[k]} + a];
}

bool SolidContactBody::solve_alone() {
  forces_.assign(axes_, 0);
  motion_.solve_alone(context_);
  return true;
}

void SolidContactBody::move(double share, std::span<const VertexForce> forces) {
  spread(forces);
  std::vector<double> change = forces_;
  for (std::size_t axis = 0; axis < axes_; ++axis)
    change[axis] -= linearised_[axis];
  motion_.move_iterate(share, change, context_);
}

} // namespace gewebe::dynamics
