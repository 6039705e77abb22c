#pragma once
// PLY, the mesh format of our pipes (gewebe_mesh(5)). In memory, exact, strict.
//
// Written: binary little-endian; element vertex with double x y z, and float nx ny nz if the mesh
// has normals; element face with list uchar int vertex_indices, then, each only if the mesh has it,
// list uchar float texcoord (s t of the three corners), int part, int material. Read: ascii and
// both binary orders, the properties above as any scalar type, the name vertex_index too, polygons
// (cut into triangles), other elements and properties (skipped by their type).

#include "geometry/mesh.h"

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace gewebe::formats {

/// What a reader passed over or changed.
struct PlyStats {
  std::uint64_t polygons = 0;           ///< faces with more than three corners, cut into triangles
  std::uint64_t skipped_elements = 0;   ///< elements of the header that are neither vertex nor face
  std::uint64_t skipped_properties = 0; ///< properties of vertex and face that we have no use for
};

/// The mesh in `bytes`, coordinates as they stand there. A vertex without face and a mesh without
/// face are valid. Normals are scaled to unit length unless they are within 1e-5 of it (or zero).
/// \throw Error, place `name` ("byte N: …" in the text) or `name:LINE` in the header and in ascii:
/// anything missing, surplus, out of range, not finite; counts that the remaining bytes can't hold
TriangleMesh read_ply(std::string_view bytes, const std::string& name, PlyStats* stats = nullptr);

/// The bytes of the mesh; reading them gives the same mesh bit for bit (up to the sign of NaN,
/// which check_mesh forbids). \pre check_mesh(mesh) passes \throw Error if an index doesn't fit the
/// format's int
std::string write_ply(const TriangleMesh& mesh);

/// The same bytes, in pieces, to `sink`.
void write_ply(const TriangleMesh& mesh, const std::function<void(std::string_view)>& sink);

} // namespace gewebe::formats
