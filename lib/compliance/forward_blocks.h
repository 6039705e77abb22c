#pragma once
// Blocks of the compliance between a few nodes, from forward solves with a factor that is updated
// after cuts. Contact forces need only these blocks, and no column of C.

#include "compliance/compliance_source.h"
#include "linalg/frontal_factor.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

namespace gewebe {

class ForwardBlocks {
public:
  /// \param check  called before the factor is read; throws if it is no longer that of the model
  ForwardBlocks(std::shared_ptr<FrontalFactor> factor, std::function<void()> check);

  /// Prepares blocks between these nodes, and between these and nodes that were needed before.
  /// Earlier nodes may be dropped.
  void need(std::span<const std::uint32_t> nodes);
  /// \pre both nodes were in the last call of need()
  ComplianceBlock block(std::uint32_t node, std::uint32_t other) const;
  /// C f at these nodes, from a solution that the factor updates from cut to cut.
  /// \pre the nodes were among the last ones needed
  std::vector<Vec3> answers(std::span<const double> over_axes,
                            std::span<const std::uint32_t> nodes);

private:
  std::shared_ptr<FrontalFactor> factor_;
  std::function<void()> check_;
  std::unordered_map<std::uint32_t, FrontalFactor::ForwardSolve> solves_;
};

} // namespace gewebe
