#pragma once
// The pass over all values behind Grid::summary.

#include "volume/grid.h"

namespace gewebe::volume {

ValueSummary summarize_values(const Context& context, std::span<const LeafView> leaves,
                              std::span<const TileView> tiles, const GridInfo& info);

} // namespace gewebe::volume
