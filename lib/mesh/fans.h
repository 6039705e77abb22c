#pragma once
// What meets at each point of a mesh, looked at while it is in cache: all that can be said about
// edges and points.

#include "base/context.h"
#include "geometry/mesh.h"

#include <cstdint>
#include <vector>

namespace gewebe::mesh {

/// Sums over the fans of all points; what they mean is said in mesh/check.h and mesh/quality.h.
struct FanFigures {
  std::uint64_t unused_points = 0, nonmanifold_points = 0, duplicate_faces = 0;
  std::uint64_t edges = 0, boundary_edges = 0, nonmanifold_edges = 0, misoriented_edges = 0;
  double edge_min = 0, edge_max = 0;
  double stiffness_max = 0; ///< largest sum of 1 / length of the edges at a point
  double length_sum = 0;
  /// Of all edges, in pieces; rounded, for counting.
  std::vector<std::vector<float>> lengths;
  /// For each point the smallest of it and the points that an edge joins it to.
  std::vector<std::uint32_t> joined_to;
};

/// Faces with equal corners are left out. Time grows with points and faces (those of a point are
/// sorted where they are no ring); least where the numbers of points and faces follow their places.
/// \pre check_mesh(mesh) passes   \throw Error if there are more than 2^32 / 3 triangles; Cancelled
FanFigures examine_fans(const TriangleMesh& mesh, const Context& context);

} // namespace gewebe::mesh
