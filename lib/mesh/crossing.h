#pragma once
// Two surfaces that pass through each other, both refined along the curve in which they do, so that
// they share its points and edges.

#include "base/error.h"
#include "geometry/mesh.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gewebe::mesh {

/// A surface whose triangles that met the other one have been split. Points and triangles before
/// keep their numbers; of a triangle before the first part does.
struct RefinedSurface {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t> from; ///< of each triangle: the one before in which it lies
};

struct SurfaceCrossing {
  RefinedSurface a, b;
  /// Where they meet: an edge of each, its ends in the same order.
  struct Edge {
    std::array<std::uint32_t, 2> a{}, b{};
  };
  std::vector<Edge> curve;
};

/// They meet in a way that no two sheets do.
class MeetingOfNoSheets : public Error {
public:
  using Error::Error;
};

/// By exact predicates and constructions, points rounded at the end (CGAL's corefinement). Points
/// that stand on the other surface already are taken as they are. Time grows with the triangles
/// whose boxes meet.
/// \pre check_mesh() passes for both, each is oriented; neither passes through itself where it
/// meets the other
/// \throw MeetingOfNoSheets; before any work where edges of one lie on each other near the other
SurfaceCrossing cross_surfaces(const TriangleMesh& a, const TriangleMesh& b);

} // namespace gewebe::mesh
