#pragma once
// Blocks of the compliance between a few nodes, from forward solves with a factor that is updated
// after cuts. Contact forces need only these blocks, and no column of C.

#include "compliance/compliance_source.h"
#include "linalg/frontal_factor.h"

#include <cstdint>
#include <functional>
#include <span>
#include <unordered_map>
#include <vector>

namespace gewebe::compliance {

class ForwardBlocks {
public:
  /// \param factor  always the same one; called whenever it is read
  explicit ForwardBlocks(std::function<linalg::FrontalFactor&()> factor);

  /// Prepares blocks between these nodes, and between these and nodes that were needed before.
  /// Earlier nodes may be dropped.
  void need(std::span<const std::uint32_t> nodes);
  /// \pre both nodes were in the last call of need()
  ComplianceBlock block(std::uint32_t node, std::uint32_t other) const;
  /// C f at these nodes, from a solution that the factor updates from cut to cut.
  std::vector<Vec3> answers(std::span<const double> over_axes,
                            std::span<const std::uint32_t> nodes);

private:
  std::function<linalg::FrontalFactor&()> factor_;
  std::unordered_map<std::uint32_t, linalg::FrontalFactor::ForwardSolve> solves_;
};

} // namespace gewebe::compliance
