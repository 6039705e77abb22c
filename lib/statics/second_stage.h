#pragma once
// Model of the second stage of the two-step method: that of the first stage with other stiffnesses.

#include "model/model.h"

#include <cstdint>
#include <span>

namespace gewebe {

/// Whether both models have the same positions and constraints of nodes, and their springs and
/// triangles join the same nodes.
bool same_but_stiffness(const Model& first, const Model& second);

/// Cut model of the second stage, from that of the first stage. The stiffness of each spring is
/// multiplied by the ratio of second to first stage of the springs that it comes from.
/// \param origin  by node of `cut`: the node before
/// \pre same_but_stiffness(first, second); `cut` was made from `first`
Model cut_second_stage(const Model& cut, std::span<const std::uint32_t> origin, const Model& first,
                       const Model& second);

} // namespace gewebe
