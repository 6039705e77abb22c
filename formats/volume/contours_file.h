#pragma once
// Contours as text (voxelize(1)): a point `x y z` per line, blank lines between contours, #
// comments.

#include "labels/contour_density.h"

#include <string>
#include <string_view>
#include <vector>

namespace gewebe::formats {

/// Reads closed contours. Coordinates are multiplied by `unit` (mm per unit of the file). A last
/// point that repeats the first is dropped.
/// \throw Error (place "name:LINE") for a line that is not three finite numbers, and for a contour
/// of fewer than three points; (place name) if there is no contour
std::vector<labels::Contour> read_contours(std::string_view text, const std::string& name,
                                           double unit = 1);

} // namespace gewebe::formats
