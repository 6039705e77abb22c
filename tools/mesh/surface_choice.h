#pragma once
// Which part of a surface mc-opt keeps.

#include "geometry/vec3.h"
#include "mesh/components.h"

#include <string>
#include <vector>

namespace gewebe::cli {

/// "largest", a number of components, or "min-volume:V"; all if empty. \throw UsageError
mesh::ComponentChoice component_choice(const std::string& text);

/// Of X0, Y0, Z0, X1, Y1, Z1; empty without numbers. \throw UsageError if it has no volume
Box3 box_of(const std::vector<double>& numbers);

} // namespace gewebe::cli
