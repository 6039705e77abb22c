#pragma once
// Check for mechanisms: components whose fixed nodes leave a rigid motion.

#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe::model {

/// A component with some rigid motions held and some free.
struct Hinged {
  std::uint32_t component = 0;
  std::size_t nodes = 0; ///< of its surface
  std::size_t held = 0;  ///< fixed nodes, central ones included
};

/// Finds components with a fixed central node whose fixed nodes (those of the surface included)
/// leave a rigid motion: they have one position, or lie on one line, within a millionth of the
/// component's size. Components without fixed nodes are free on purpose, and left out.
/// \pre check_model(model) passes
std::vector<Hinged> hinged_components(const Model& model);

} // namespace gewebe::model
