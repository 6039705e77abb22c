#pragma once
// Conversions of surfaces for styles of drawing.

#include "geometry/mesh.h"
#include "shading/camera.h"
#include "shading/drawing.h"

#include <vector>

namespace gewebe::shading {

/// The surface with three separate points for each triangle and without normals, so that each point
/// has its face's normal.
Surface faceted(const Surface& surface);

/// The surface with sharp edges: both sides of an edge have separate points if the normals of its
/// two faces differ by more than an angle. The angle is measured at rest if the surface has rest
/// positions. Points with copies have no normals of their own. An edge of one face, or of more than
/// two, separates nothing by itself. \param degrees  0 … 180
Surface creased(const Surface& surface, double degrees);

/// The surfaces with front and back sides for an eye. Triangles that face away from the eye go to
/// further surfaces after all others, reversed and marked as seen from inside. Normals are those of
/// the whole surface. Instruments are not divided. Numbers of the given surfaces stay the same.
std::vector<Surface> two_sided(std::vector<Surface> surfaces, const Vec3& eye);

/// The edges of the triangles as ribbons that face the camera, `pixels` wide in a picture of
/// `height` pixels. Each edge is drawn once; edges and parts of them behind the eye are left out.
Surface wireframe(const Surface& surface, const Camera& camera, double pixels,
                  std::uint32_t height);

} // namespace gewebe::shading
