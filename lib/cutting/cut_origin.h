#pragma once
// Reconstruction of the origins of a cut model's nodes from the models before and after the cut.

#include "model/model.h"

#include <cstdint>
#include <vector>

namespace gewebe::cutting {

/// An old node that the later model has no copy of.
inline constexpr std::uint32_t gone_node = UINT32_MAX;

struct CutOrigin {
  std::vector<std::uint32_t> origin; ///< by node of the later model
  std::vector<std::uint32_t> place;  ///< by node of the earlier: its number now, or gone_node
};

/// Finds origins and places by position. A node's origin is the old node at exactly its position.
/// If there are several, it is the one of the same number, else the one with most springs to the
/// same positions, else the lowest. The place of an old node is the new node of its number if that
/// comes from it, else the lowest one that does.
/// \throw Error that names a node at the position of no old one: the later model isn't cut from the
/// earlier
CutOrigin find_cut_origin(const model::Model& before, const model::Model& after);

} // namespace gewebe::cutting
