#pragma once
// Colours of tissue for pictures that were told none.

#include "base/vec3.h"

#include <cstddef>
#include <string_view>

namespace gewebe {

/// The colour, 0 … 1, of the material `number` of a model: that of its name, where it is one of the
/// presets (model/material.h), else one of eight that numbers have in turn. A choice: organs in
/// books look so.
Vec3 tissue_color(std::string_view name, std::size_t number);

} // namespace gewebe
