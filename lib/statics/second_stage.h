#pragma once
// The model of the second stage of the two-step method: that of the first with other stiffnesses.

#include "model/model.h"

#include <cstdint>
#include <span>

namespace gewebe {

/// Whether nodes stand and are held alike, and springs and triangles join the same ones.
bool same_but_stiffness(const Model& first, const Model& second);

/// A cut model of the second stage, from that of the first: each spring is stiffer by as much as
/// the springs that it comes from. \param origin by node of `cut`: the node before
/// \pre same_but_stiffness(first, second); `cut` was made from `first`
Model cut_second_stage(const Model& cut, std::span<const std::uint32_t> origin, const Model& first,
                       const Model& second);

} // namespace gewebe
