#pragma once
// Model of the second stage of the two-step method: that of the first stage with other stiffnesses.

#include "model/model.h"

#include <cstdint>
#include <span>

namespace gewebe::statics {

/// Whether both models have the same positions and constraints of nodes, and their springs and
/// triangles join the same nodes.
bool same_but_stiffness(const model::Model& first, const model::Model& second);

/// Cut model of the second stage, from that of the first stage. The stiffness of each spring is
/// multiplied by the ratio of second to first stage of the springs that it comes from.
/// \param origin  by node of `cut`: the node before
/// \pre same_but_stiffness(first, second); `cut` was made from `first`
model::Model cut_second_stage(const model::Model& cut, std::span<const std::uint32_t> origin,
                              const model::Model& first, const model::Model& second);

} // namespace gewebe::statics
