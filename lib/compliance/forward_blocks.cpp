#include "compliance/forward_blocks.h"

#include <utility>

namespace gewebe::compliance {

namespace {

constexpr std::size_t max_kept = 1024; ///< nodes; some 50 kB each on 10,000 nodes

} // namespace

ForwardBlocks::ForwardBlocks(std::function<linalg::FrontalFactor&()> factor)
    : factor_(std::move(factor)) {}

void ForwardBlocks::need(std::span<const std::uint32_t> nodes) {
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t node : nodes)
    if (!solves_.contains(node))
      missing.push_back(node);
  if (missing.empty())
    return;
  if (solves_.size() + missing.size() > max_kept) {
    solves_.clear();
    missing.assign(nodes.begin(), nodes.end());
  }
  std::vector<linalg::FrontalFactor::ForwardSolve> solved = factor_().forward_solves(missing);
  for (std::size_t k = 0; k < missing.size(); ++k)
    solves_[missing[k]] = std::move(solved[k]);
}

ComplianceBlock ForwardBlocks::block(std::uint32_t node, std::uint32_t other) const {
  return factor_().compliance(solves_.at(node), solves_.at(other));
}

std::vector<Vec3> ForwardBlocks::answers(std::span<const double> over_axes,
                                         std::span<const std::uint32_t> nodes) {
  need(nodes); // they may have been dropped since
  linalg::FrontalFactor& factor = factor_();
  (void)factor.carry(over_axes);
  std::vector<Vec3> all;
  all.reserve(nodes.size());
  for (const std::uint32_t node : nodes) {
    const std::array<double, 3> u = factor.carried(solves_.at(node));
    all.push_back({u[0], u[1], u[2]});
  }
  return all;
}

} // namespace gewebe::compliance
