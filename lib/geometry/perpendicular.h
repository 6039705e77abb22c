#pragma once
// Direction perpendicular to another one.

#include "geometry/vec3.h"

#include <cmath>

namespace gewebe {

/// Perpendicular to n, not of unit length: its product with the axis along which n is least.
inline Vec3 some_perpendicular(const Vec3& n) {
  int least = 0;
  for (int a = 1; a < 3; ++a)
    if (std::abs(n[a]) < std::abs(n[least]))
      least = a;
  Vec3 axis;
  axis[least] = 1;
  return cross(n, axis);
}

} // namespace gewebe
