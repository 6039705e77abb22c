#pragma once
// Other geometry for other styles of drawing.

#include "base/mesh.h"
#include "shading/camera.h"
#include "shading/drawing.h"

namespace gewebe {

/// The surface with three points of their own for each triangle and without normals, so that each
/// has its face's normal.
Surface faceted(const Surface& surface);

/// The edges of the triangles as ribbons that face the camera, `pixels` wide in a picture of
/// `height`; each edge once, as its points lie. Edges and parts of them behind the eye are left
/// out.
Surface wireframe(const Surface& surface, const Camera& camera, double pixels,
                  std::uint32_t height);

} // namespace gewebe
