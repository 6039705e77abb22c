#pragma once
// The point of a triangle that is nearest to another point.

#include "geometry/vec3.h"

namespace gewebe::mesh {

/// Where on a triangle the point nearest to another lies.
struct NearestPoint {
  Vec3 point;
  /// 0: within the face; 1, 2, 3: on the edge from corner 0, 1, 2 to the next; 4, 5, 6: corner 0,
  /// 1, 2
  int feature = 0;
};

/// After C. Ericson, Real-Time Collision Detection, 2005, section 5.1.5.
NearestPoint nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

} // namespace gewebe::mesh
