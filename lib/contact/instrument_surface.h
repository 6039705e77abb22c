#pragma once
// Instruments as triangles, for pictures of them.

#include "contact/instrument.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <cstddef>
#include <vector>

namespace gewebe::contact {

struct InstrumentSurface {
  std::vector<Vec3> points;  ///< all of them on the surface
  std::vector<Vec3> normals; ///< its own, one per point
  std::vector<Triangle> triangles;
};

/// All points at a radius from the straight line from 0 to `axis`, or from 0 itself: a closed mesh
/// whose triangles are counter-clockwise seen from outside. `around` corners make a ring, a quarter
/// as many rings half a sphere; the straight part is divided into `along` parts. Products and
/// square roots alone, so that all machines have the same digits. \pre radius > 0; around is a
/// power of 2, at least 4; along > 0
InstrumentSurface round_surface(double radius, const Vec3& axis, std::size_t around,
                                std::size_t along = 1);

/// All points at a radius from a polyhedron: its faces moved out, strips along its edges and caps
/// on its corners between them, flat but with the normals of the faces. Closed and oriented alike.
InstrumentSurface hull_surface(const ConvexCore& core, double radius);

/// What an instrument is shown as, around its own origin; none of a blade without length. \param
/// around, along as round_surface has them
InstrumentSurface shown_surface(const InstrumentShape& shape, std::size_t around,
                                std::size_t along = 1);

/// The radius that an instrument is shown with: its own; of a blade, which has none, a hundredth of
/// its length.
double shown_radius(const InstrumentShape& shape);

/// Whether both have one surface around their own origin.
bool same_surface(const InstrumentShape& a, const InstrumentShape& b);

} // namespace gewebe::contact
