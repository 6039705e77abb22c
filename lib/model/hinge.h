#pragma once
// Components that what is fixed holds, but not in every way.

#include "model/model.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gewebe {

/// A component of which some rigid motions are held and some are not.
struct Hinged {
  std::uint32_t component = 0;
  std::size_t nodes = 0; ///< of its surface
  std::size_t held = 0;  ///< nodes that something fixes, central ones among them
};

/// Components with a fixed central node whose fixed nodes, those of the surface among them, leave a
/// rigid motion: one place, or places on one line, within a millionth of the component's size. What
/// nothing holds is free on purpose and not among them. \pre check_model(model) passes
std::vector<Hinged> hinged_components(const Model& model);

} // namespace gewebe
