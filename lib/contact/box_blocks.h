#pragma once
// Things in blocks of neighbours, each with a box around it, so that who looks for what is near
// something asks little of it.

#include "base/vec3.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe {

/// Numbers 0, 1, … in the order of their blocks.
struct BlockOrder {
  std::vector<std::uint32_t> order; ///< ascending in each block
  std::vector<std::size_t> first;   ///< place in `order` of each block, and the end
};

/// Blocks of at most `most` things by their middles: halved along the longest side until small;
/// ties by number, so that the order is one. \pre most > 0
BlockOrder block_order(std::span<const Vec3> middle, std::size_t most);

} // namespace gewebe
