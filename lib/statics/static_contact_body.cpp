#include "statics/static_contact_body.h"

#include "contact/island.h"
#include "geometry/vector_at.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

namespace gewebe::statics {

using contact::Block3, contact::VertexForce;

namespace {

/// Part of the room in which a shape is taken at once: forces change by twice of it.
constexpr double shape_room = 0.1;

} // namespace

StaticContactBody::StaticContactBody(StaticContactState state)
    : state_(std::move(state)),
      displacement_(state_.displacement.begin(), state_.displacement.end()) {}

void StaticContactBody::positions(std::span<Vec3> x) {
  const std::span<const double> u = displacement_;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const std::uint32_t node = state_.surface->node[k];
    x[k] = state_.model->nodes[node].position + vector_at(u, place_of(k));
  }
}

void StaticContactBody::act(std::span<const VertexForce> forces) {
  acting_ = *state_.load;
  for (const VertexForce& f : forces)
    if (const std::uint32_t node = state_.surface->node[f.vertex];
        !acting_.displacement.contains(node))
      acting_.force[node] += f.force;
}

double StaticContactBody::linearise(std::span<const VertexForce> forces, std::span<Vec3> step) {
  act(forces);
  const std::span<const double> u = shape_under(acting_);
  if (state_.require_shape)
    state_.require_shape(u);
  // Of all nodes, or of the surface's alone.
  displacement_.resize(std::min(displacement_.size(), u.size()));
  begin_ = displacement_;
  forces_.assign(forces.begin(), forces.end());
  if (!is_linear())
    shape_.assign(u.begin(), u.begin() + std::ssize(begin_));
  step_.resize(begin_.size());
  double most = 0;
  for (std::size_t k = 0; k < begin_.size(); ++k) {
    step_[k] = u[k] - begin_[k];
    most = std::max(most, std::abs(step_[k]));
  }
  for (std::size_t k = 0; k < step.size(); ++k)
    step[k] = vector_at(std::span<const double>(step_), place_of(k));
  return state_.surface->typical.force * most;
}

void StaticContactBody::compliance(std::uint32_t vertex, std::span<const std::uint32_t> rows,
                                   std::span<Block3> blocks) {
  const std::uint32_t node = state_.surface->node[vertex];
  std::ranges::fill(blocks, Block3{});
  if (!is_linear() && !std::ranges::equal(rows, rows_))
    rows_.assign(rows.begin(), rows.end());
  if (load().displacement.contains(node))
    return;
  std::vector<std::uint32_t> nodes;
  std::vector<std::size_t> place;
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (const std::uint32_t row = state_.surface->node[rows[k]];
        !load().displacement.contains(row)) {
      nodes.push_back(row);
      place.push_back(k);
    }
  std::vector<Block3> found(nodes.size());
  blocks_of(node, nodes, found);
  for (std::size_t k = 0; k < place.size(); ++k)
    blocks[place[k]] = found[k];
}

void StaticContactBody::move(double share, std::span<const VertexForce> forces) {
  if (is_linear()) {
    act(forces);
    const std::span<const double> u = shape_under(acting_);
    for (std::size_t k = 0; k < displacement_.size(); ++k)
      displacement_[k] = u[k] - (share > 0 ? share * step_[k] : 0);
    return;
  }
  std::map<std::uint32_t, Vec3> changes;
  for (const VertexForce& f : forces)
    changes[f.vertex] += f.force;
  for (const VertexForce& f : forces_)
    changes[f.vertex] -= f.force;
  for (std::size_t k = 0; k < displacement_.size(); ++k)
    displacement_[k] = shape_[k] - (share > 0 ? share * step_[k] : 0);
  std::vector<Block3> blocks(rows_.size());
  for (const auto& [vertex, f] : changes) {
    if (f == Vec3{})
      continue;
    compliance(vertex, rows_, blocks);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      const Block3& b = blocks[k];
      for (std::size_t a = 0; a < 3; ++a)
        displacement_[axis_of(place_of(rows_[k]), static_cast<int>(a))] +=
            b[3 * a] * f.x + b[3 * a + 1] * f.y + b[3 * a + 2] * f.z;
    }
  }
  act(forces);
}

/// At rest: whether it has the shape that belongs to its forces, which it takes where it is near.
bool StaticContactBody::keep_momentum(double room) {
  if (is_linear())
    return true;
  const std::span<const double> u = shape_under(acting_);
  double miss = 0, largest = 0;
  for (std::size_t k = 0; k < displacement_.size(); ++k) {
    miss = std::max(miss, std::abs(u[k] - displacement_[k]));
    largest = std::max(largest, std::abs(u[k]));
  }
  if (miss <= shape_room * room) {
    displacement_.assign(u.begin(), u.begin() + std::ssize(displacement_));
    return true;
  }
  return miss <= shape_tolerance() * largest;
}

// ---- the linear method

std::span<const double> ElastostaticContactBody::shape_under(const contact::Load& load) {
  Elastostatic& solver = solver_();
  if (clusters_.empty()) {
    solver.update(load);
    return solver.surface_displacement();
  }
  std::vector<contact::NodeVector> forces;
  for (const auto& [node, force] : load.force)
    forces.push_back({node, force});
  shape_ = solver.displacement_of_clusters(clusters_, forces);
  return shape_;
}

void ElastostaticContactBody::blocks_of(std::uint32_t node, std::span<const std::uint32_t> nodes,
                                        std::span<Block3> blocks) {
  solver_().compliance_blocks(load(), node, nodes, blocks);
}

// ---- two steps

std::span<const double> TwoStepContactBody::shape_under(const contact::Load& load) {
  const auto [first, both] = stages_();
  both.update(first, load);
  return both.surface_displacement(first);
}

void TwoStepContactBody::blocks_of(std::uint32_t node, std::span<const std::uint32_t> nodes,
                                   std::span<Block3> blocks) {
  const auto [first, both] = stages_();
  const double s = both.load() > both.threshold() ? both.threshold() / both.load() : 1;
  first.compliance_blocks(load(), node, nodes, blocks);
  if (s == 1)
    return;
  std::vector<Block3> second(blocks.size());
  both.second_compliance_blocks(load(), node, nodes, second);
  const bool series = both.options().series;
  const double a = series ? s : 1, b = series ? 1 - s : s - 1;
  for (std::size_t k = 0; k < blocks.size(); ++k)
    for (std::size_t e = 0; e < 9; ++e)
      blocks[k][e] = a * blocks[k][e] + b * second[k][e];
}

// ---- large rotations

std::span<const double> WarpedContactBody::shape_under(const contact::Load& load) {
  WarpedStatics& solver = solver_();
  solver.update(load, touched_);
  compliance_.clear();
  return solver.surface_displacement();
}

void WarpedContactBody::blocks_of(std::uint32_t node, std::span<const std::uint32_t> nodes,
                                  std::span<Block3> blocks) {
  WarpedStatics& solver = solver_();
  if (compliance_.empty() || !std::ranges::equal(nodes, touched_)) {
    touched_.assign(nodes.begin(), nodes.end());
    solver.update(acting(), touched_);
    compliance_ = solver.compliance_at(touched_);
  }
  const std::size_t order = 3 * touched_.size();
  const auto at =
      static_cast<std::size_t>(std::ranges::lower_bound(touched_, node) - touched_.begin());
  for (std::size_t k = 0; k < blocks.size(); ++k)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        blocks[k][3 * i + j] = compliance_[(3 * at + j) * order + 3 * k + i];
}

} // namespace gewebe::statics
