#pragma once
// Particles as text (gewebe_particles(5)): one per line, `x y z R [weight]`, # comments.

#include "geometry/particles.h"

#include <string>
#include <string_view>

namespace gewebe::formats {

/// Coordinates and radii are multiplied by `unit` (mm per unit of the file).
/// \throw Error (place "name:LINE") for a line that is not four or five finite numbers or whose R
/// is not positive; (place name) if there is no particle
Particles read_particles(std::string_view text, const std::string& name, double unit = 1);

/// Shortest text that reads back exactly; the weight only where it is not 1.
std::string write_particles(const Particles& particles);

/// Millimetres per "mm", "cm" or "m". \throw UsageError for another word
double unit_in_mm(std::string_view unit);

} // namespace gewebe::formats
