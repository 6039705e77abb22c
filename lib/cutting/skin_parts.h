#pragma once
// The skin of a cut solid whose parts come off.

#include "cutting/cut.h"
#include "model/model.h"

#include <cstdint>

namespace gewebe::cutting {

struct SkinPartsReport {
  std::uint64_t torn = 0;  ///< edges that were not cut, between triangles of different parts
  std::uint64_t moved = 0; ///< points that follow another element, which is of their part
};

/// Gives each part (free_parts) its piece of the model's skin. Skin can still be connected where
/// its elements have come apart, because a blade was not through it yet. It is torn between
/// triangles, and a triangle goes with most of its points. The openings are closed on both sides
/// alike, by triangles about their middles. Where at most a hundredth of the points follow elements
/// of another part, these points count as lost, and nothing is torn.
/// \pre the parts are of this model; its skin is closed where it is torn
SkinPartsReport part_skin(const model::Model& model, FreeParts& parts);

} // namespace gewebe::cutting
