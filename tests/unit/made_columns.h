#pragma once
// Columns of a compliance matrix that are kept in memory, and models for them.

#include "columns/columns.h"
#include "compliance/axis_solver.h"
#include "compliance/compliance.h"
#include "stiffness_models.h"
#include "update/stiffness_change.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace gewebe::test {

inline update::AxesSolve solver(const model::Model& model) {
  auto axes =
      std::make_shared<compliance::AxisSolver>(compliance::factorise_axes(model, Context{}));
  return [axes](std::span<double> f, std::size_t columns) { axes->solve(f, columns); };
}

/// Columns of some nodes by a solver, as float32 if asked.
class Made final : public columns::ColumnSource {
public:
  Made(const model::Model& model, const update::AxesSolve& solve, std::vector<std::uint32_t> nodes,
       bool single = false)
      : count_(model.nodes.size()), nodes_(std::move(nodes)), single_(single) {
    for (const std::uint32_t node : nodes_) {
      std::vector<double>& c = kept_.emplace_back(9 * count_);
      for (std::size_t a = 0; a < 3; ++a)
        c[3 * (count_ * a + node) + a] = 1;
      solve(c, 3);
      if (single)
        for (double& x : c)
          x = static_cast<double>(static_cast<float>(x));
    }
  }
  std::size_t node_count() const override { return count_; }
  const std::vector<std::uint32_t>& nodes() const override { return nodes_; }
  bool single() const override { return single_; }
  void read(std::size_t k, std::span<double> out) const override {
    std::copy(kept_[k].begin(), kept_[k].end(), out.begin());
  }

private:
  std::size_t count_;
  std::vector<std::uint32_t> nodes_;
  bool single_;
  std::vector<std::vector<double>> kept_;
};

/// Every so many-th node.
inline std::vector<std::uint32_t> every(std::uint32_t step, const model::Model& model) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < model.nodes.size(); i += step)
    nodes.push_back(i);
  return nodes;
}

/// A ball of which some nodes are held, wholly or along z.
inline model::Model organ_ball(int rounds = 3) {
  model::Model model = model_of(ball(rounds, 20));
  for (std::size_t i = 0; i < model::surface_count(model); i += 17)
    model.nodes[i].fixed = i % 2 == 0 ? model::fixed_all : model::fixed_z;
  return model;
}

} // namespace gewebe::test
