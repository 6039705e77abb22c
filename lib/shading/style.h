#pragma once
// Other geometry for other styles of drawing.

#include "base/mesh.h"
#include "shading/camera.h"
#include "shading/drawing.h"

#include <vector>

namespace gewebe {

/// The surface with three points of their own for each triangle and without normals, so that each
/// has its face's normal.
Surface faceted(const Surface& surface);

/// The surface with points of their own on either side of each edge at which normals of two faces
/// turn by more than that, at rest where it has that, so that it is sharp there. Points that it
/// gives copies have no normals of their own. An edge of one face, or of more than two, parts
/// nothing by itself. \param degrees 0 … 180
Surface creased(const Surface& surface, double degrees);

/// The surfaces as an eye sees them: triangles that face away from it are those of further
/// surfaces, behind all others, turned around and marked as seen from inside. Normals are those of
/// the whole; instruments stay whole. Numbers of surfaces stay what they are.
std::vector<Surface> two_sided(std::vector<Surface> surfaces, const Vec3& eye);

/// The edges of the triangles as ribbons that face the camera, `pixels` wide in a picture of
/// `height`; each edge once, as its points lie. Edges and parts of them behind the eye are left
/// out.
Surface wireframe(const Surface& surface, const Camera& camera, double pixels,
                  std::uint32_t height);

} // namespace gewebe
