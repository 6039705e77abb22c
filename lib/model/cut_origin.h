#pragma once
// Where the nodes of a cut model come from, found again from the two models alone.

#include "model/model.h"

#include <cstdint>
#include <vector>

namespace gewebe {

/// An old node that the later model has no copy of.
inline constexpr std::uint32_t gone_node = UINT32_MAX;

struct CutOrigin {
  std::vector<std::uint32_t> origin; ///< by node of the later model
  std::vector<std::uint32_t> place;  ///< by node of the earlier: its number now, or gone_node
};

/// A node comes from the old one at exactly its place: of several, from that of its own number,
/// else from the one that has most springs to the same places, else from the lowest. An old node is
/// now the new one of its number if that comes from it, else the lowest that does. \throw Error
/// naming a node that is where no old one is, so that the later model isn't cut from the earlier
CutOrigin find_cut_origin(const Model& before, const Model& after);

} // namespace gewebe
