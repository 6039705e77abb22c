#pragma once
// The largest components of a mesh.

#include "geometry/mesh.h"

#include <cstdint>

namespace gewebe::mesh {

/// Which components stay: of those with at least `min_volume` mm³ the `largest` ones.
struct ComponentChoice {
  std::uint64_t largest = UINT64_MAX;
  double min_volume = 0;
};

struct ComponentReport {
  std::uint64_t kept = 0, dropped = 0;
  std::uint64_t dropped_points = 0, dropped_triangles = 0;
  double dropped_volume = 0;  ///< sum of the magnitudes of the dropped components' signed volumes
  double largest_dropped = 0; ///< mm³
};

/// What a closed surface without duplicate points is to topology.
struct Topology {
  std::uint64_t components = 0; ///< of faces connected by points
  std::int64_t euler = 0;       ///< points - edges + faces
  bool operator==(const Topology&) const = default;
};
/// \pre every edge has two faces, every point is used
Topology topology(const TriangleMesh& mesh);

/// Drops components (of faces connected by points) by the magnitude of their signed volume. A
/// cavity is a component of its own. Of equal volumes the one with the first point counts as
/// larger. What stays keeps its order, points that no face uses vanish, and so do the optional
/// arrays' entries with their points and faces. \pre check_mesh(mesh) passes
ComponentReport keep_components(TriangleMesh& mesh, const ComponentChoice& choice);

} // namespace gewebe::mesh
