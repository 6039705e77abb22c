#include "compliance/half_blocks.h"

#include <utility>

namespace gewebe {

namespace {

constexpr std::size_t max_kept = 1024; ///< nodes; some 50 kB each on 10,000 nodes

} // namespace

HalfBlocks::HalfBlocks(std::shared_ptr<const FrontalFactor> factor, std::function<void()> check)
    : factor_(std::move(factor)), check_(std::move(check)) {}

void HalfBlocks::need(std::span<const std::uint32_t> nodes) {
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t node : nodes)
    if (!half_.contains(node))
      missing.push_back(node);
  if (missing.empty())
    return;
  check_();
  if (half_.size() + missing.size() > max_kept) {
    half_.clear();
    missing.assign(nodes.begin(), nodes.end());
  }
  std::vector<FrontalFactor::HalfSolution> solved = factor_->half_solutions(missing);
  for (std::size_t k = 0; k < missing.size(); ++k)
    half_[missing[k]] = std::move(solved[k]);
}

ComplianceBlock HalfBlocks::block(std::uint32_t node, std::uint32_t other) const {
  return factor_->compliance(half_.at(node), half_.at(other));
}

} // namespace gewebe
