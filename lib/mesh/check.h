#pragma once
// What can be said about a triangle mesh: is it closed, manifold, oriented, and how well shaped.

#include "base/context.h"
#include "geometry/mesh.h"
#include "mesh/quality.h"

#include <cstdint>

namespace gewebe::mesh {

/// Counts over the topology (indices) and the geometry of a mesh. Edges join two different points;
/// faces with equal corners are counted as `degenerate_faces` and take no part in anything else.
struct MeshReport {
  std::uint64_t points = 0, triangles = 0;
  std::uint64_t unused_points = 0; ///< in no (proper) face
  std::uint64_t edges = 0;
  std::uint64_t boundary_edges = 0;     ///< in one face
  std::uint64_t nonmanifold_edges = 0;  ///< in three faces or more
  std::uint64_t misoriented_edges = 0;  ///< in two faces that run along it in the same direction
  std::uint64_t nonmanifold_points = 0; ///< whose faces are no single fan round it
  std::uint64_t degenerate_faces = 0;   ///< with equal corner indices
  std::uint64_t duplicate_faces = 0;    ///< with the same three corners as an earlier one
  std::uint64_t zero_area_faces = 0;    ///< area <= 1e-12 longest edge²
  std::uint64_t components = 0;         ///< of faces connected by points
  /// Components whose signed volume has the wrong sign: it should be positive, but negative for a
  /// shell that lies inside an odd number of other shells (a cavity). Means little for open ones.
  std::uint64_t inverted_components = 0;
  std::int64_t euler = 0;    ///< used points - edges + faces
  double volume = 0;         ///< signed, mm³, by the divergence theorem
  double area = 0;           ///< mm²
  double smallest_angle = 0; ///< degrees; 0 with zero-area faces; 180 without faces
  double edge_min = 0, edge_mean = 0, edge_max = 0; ///< mm

  bool closed() const { return boundary_edges == 0; }
  /// Every edge in at most two faces, every point in one fan, no face twice or with equal corners.
  bool manifold() const {
    return nonmanifold_edges == 0 && nonmanifold_points == 0 && degenerate_faces == 0 &&
           duplicate_faces == 0;
  }
  bool oriented() const { return misoriented_edges == 0; }
  /// Of a closed, manifold, oriented mesh: does it face outward?
  bool outward() const { return closed() && oriented() && inverted_components == 0; }
};

/// Examines a mesh, and its quality if requested, in two passes over what is in cache:
/// round the points, and over the faces. Time and memory grow with points and faces (sorting inside
/// a point's list). The same figures for any number of threads.
/// Whether a component lies in another is decided by the parity of the crossings along +z from its
/// largest face; of shells that touch each other there the answer may be either.
/// \pre check_mesh(mesh) passes: indices in range, coordinates finite
/// \throw Error if there are more than 2^32 / 3 triangles; Cancelled
MeshReport examine_mesh(const TriangleMesh& mesh, const Context& context = {},
                        MeshQuality* quality = nullptr);

} // namespace gewebe::mesh
