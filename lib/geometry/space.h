#pragma once
// The anatomical space of coordinates in mm. RAS: x grows to the patient's right, y to the front
// (anterior), z to the head (superior); NIfTI, 3D Slicer's scene, FreeSurfer. LPS: x to the left, y
// to the back (posterior); DICOM, ITK, most meshes. One is the other turned by half a turn about z.

#include "geometry/vec3.h"

#include <string_view>

namespace gewebe {

enum class Space { unknown, ras, lps };

/// "RAS", "LPS"; "" for unknown.
constexpr std::string_view space_name(Space space) {
  return space == Space::ras ? "RAS" : space == Space::lps ? "LPS" : "";
}

/// The space of that name in upper or lower case, or unknown.
constexpr Space space_from_name(std::string_view name) {
  return name == "RAS" || name == "ras"   ? Space::ras
         : name == "LPS" || name == "lps" ? Space::lps
                                          : Space::unknown;
}

/// Whether coordinates of one space are wrong in the other.
constexpr bool spaces_differ(Space a, Space b) {
  return a != Space::unknown && b != Space::unknown && a != b;
}

/// RAS to LPS, or LPS to RAS: a position or a direction.
constexpr Vec3 other_space(const Vec3& v) {
  return {0 - v.x, 0 - v.y, v.z}; // no -0
}

} // namespace gewebe
