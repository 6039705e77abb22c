#pragma once
// Writers of OBJ and binary STL. Our own, for assimp's OBJ has single precision and its STL a fixed
// name.

#include "geometry/mesh.h"

#include <functional>
#include <string_view>

namespace gewebe::formats {

/// OBJ: v with every digit of the doubles, vt (each value once), vn if there are normals, f; an `o
/// partN` and a `usemtl materialN` line where these change, if the mesh has them. No mtllib. \pre
/// check_mesh(mesh) passes
void write_obj(const TriangleMesh& mesh, const std::function<void(std::string_view)>& sink);

/// Binary STL: single precision, face normals by the right-hand rule (0 0 0 without area), no part,
/// material or texture.
/// \pre check_mesh(mesh) passes
/// \throw Error if a coordinate doesn't fit single precision, or there are over 2^32 - 1 triangles
void write_stl(const TriangleMesh& mesh, const std::function<void(std::string_view)>& sink);

} // namespace gewebe::formats
