#pragma once
// Whether two boxes have a point in common.

#include "geometry/vec3.h"

namespace gewebe {

/// Boxes are closed; false if a coordinate is NaN.
inline bool meet(const Box3& a, const Box3& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(a.min[axis] <= b.max[axis] && b.min[axis] <= a.max[axis]))
      return false;
  return true;
}

} // namespace gewebe
