#pragma once
// Reader of VTK's surfaces in XML, .vtp, see gewebe_mesh(5).

#include "geometry/mesh.h"

#include <cstdint>
#include <string>
#include <string_view>

namespace gewebe::formats {

struct VtpStats {
  std::uint64_t polygons = 0;           ///< with more than three corners, cut into triangles
  std::uint64_t skipped_primitives = 0; ///< points and lines
};

/// The triangles of PolyData, polygons and strips cut into such, in their order (polygons first),
/// with all points; parts and materials by the integers `part` and `material` of cells, texture
/// coordinates by those that the file calls its own.
/// \throw Error with place (`name` or `name:LINE`): anything missing, surplus, out of range, not
/// finite; counts that the file can't hold; more than one piece; data packed by another than zlib;
/// parts or materials beside both polygons and strips, whose order VTK's programs do not share
TriangleMesh read_vtp(std::string_view bytes, const std::string& name, VtpStats* stats = nullptr);

} // namespace gewebe::formats
