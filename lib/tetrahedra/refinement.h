#pragma once
// Regions of a solid with smaller cells.

#include "geometry/vec3.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gewebe::tetrahedra {

/// Where cells are at most `cell` mm large: in all of the bodies below at once.
struct RefinedRegion {
  struct Sphere {
    Vec3 centre;
    double radius = 0;
  };
  std::string text; ///< as given, for messages
  std::vector<Sphere> spheres;
  std::vector<Box3> boxes;             ///< of the world
  std::vector<std::int32_t> materials; ///< cells near a place of this material
  bool surface = false;                ///< cells near the surface
  double cell = 0;
};

/// Reads "TERM [and TERM ...]:SIZE[; ...]", TERM being sphere:X,Y,Z,R, box:X0,Y0,Z0,X1,Y1,Z1,
/// surface or label:N. \throw Error that says what is wrong
std::vector<RefinedRegion> parse_refinement(std::string_view text);

} // namespace gewebe::tetrahedra
