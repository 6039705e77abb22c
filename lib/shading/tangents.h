#pragma once
// Normals, and the frames of tangent, bitangent and normal (TBN) in which a texture lies on a
// surface. Report 3.2.3; Lengyel, Mathematics for 3D Game Programming and Computer Graphics, 2003.

#include "base/context.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::shading {

/// Per point, the sum of the normals of its triangles weighted by area, of unit length; 0 where
/// there is none. \pre the triangles' corners index `points`
std::vector<Vec3> area_normals(std::span<const Vec3> points, std::span<const Triangle> triangles);

/// The mesh's own normals where it has them and they are not 0, else area_normals.
std::vector<Vec3> render_normals(const TriangleMesh& mesh);

/// Vertices as they are drawn: one for each point and each different pair of texture coordinates
/// that it has, apart where the texture is mirrored, since then the tangents differ too.
struct TexturedVertices {
  std::vector<std::uint32_t> point;     ///< of the mesh
  std::vector<std::array<float, 2>> st; ///< texture coordinates
  std::vector<Triangle> triangles;      ///< those of the mesh, over these vertices
  std::vector<Vec3> tangent, bitangent; ///< only if requested
  // What frames are made from again when the points move.
  std::vector<std::size_t> first_corner; ///< of each vertex in `corner`, and the end
  std::vector<std::size_t> corner;       ///< 3 t + c
  std::vector<bool> mirrored;            ///< vertices whose texture is
};

/// Splits the mesh by `texcoords` (six per triangle). With `normals`, one per point, also the
/// frames: T is the direction of growing s, the mean over the vertex's triangles weighted by area,
/// made perpendicular to N and of unit length; B = ±N × T is the side of growing t. T = B = 0 where
/// the coordinates give no direction (triangles without area, in space or in the texture) or N is
/// 0. The same for any number of threads. \throw Cancelled
TexturedVertices split_vertices(const TriangleMesh& mesh,
                                std::span<const std::array<float, 6>> texcoords,
                                const std::vector<Vec3>* normals, const Context& context);

/// Computes the frames again after points or normals of a mesh moved; its triangles and
/// coordinates are those that were split. \pre it was split with normals
void renew_frames(TexturedVertices& vertices, const TriangleMesh& mesh,
                  std::span<const std::array<float, 6>> texcoords, const std::vector<Vec3>& normals,
                  const Context& context);

} // namespace gewebe::shading
