#pragma once
// The matrix primitives of the report (3.1.1): surfaces whose nodes stand in a matrix of m times n,
// with the regular springs that follow from it.

#include "geometry/mesh.h"

#include <cstdint>
#include <string_view>

namespace gewebe::model {

enum class PrimitiveShape { plane, tube, sphere };

struct Primitive {
  PrimitiveShape shape = PrimitiveShape::plane;
  std::uint32_t m = 2, n = 2;
  double a = 100, b = 100; ///< mm: sides of the plane; radius and length of the tube; radius

  bool operator==(const Primitive&) const = default;
};

/// "plane:MxN", "tube:MxN", "sphere:MxN", with `size` "", "a" or "a,b" in mm: by default a plane of
/// 100 by 100, a tube of radius 20 and length 100, a sphere of radius 50. \throw Error if it is
/// none, or a size is not positive, or there are under 2 x 2 nodes (tube 3 x 2, sphere 3 x 1) or
/// over 1e8
Primitive parse_primitive(std::string_view text, std::string_view size);

/// Node (i, j), 0 <= i < m, 0 <= j < n, is point j m + i. Plane: x = a i/(m-1), y = b j/(n-1), z =
/// 0, seen from +z. Tube: m nodes around the z axis, n along it from 0 to b, open at its ends.
/// Sphere: m nodes around and n rings from the south, then the south and the north pole. Seen from
/// outside. The same bytes on every machine.
TriangleMesh primitive_mesh(const Primitive& primitive);

} // namespace gewebe::model
