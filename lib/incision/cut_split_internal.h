#pragma once
// Bisection of tetrahedra at nodes in their edges, and the dihedral angles of the parts.

#include "geometry/vec3.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace gewebe::incision {

/// The largest |cos| of a dihedral angle; 2 without a positive volume.
double sharpness(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// A node in an edge.
struct EdgeNode {
  std::array<std::uint32_t, 2> ends{};
  std::uint32_t node = 0;
};

/// Visits the parts of a tetrahedron with nodes in some of its edges: it is halved at the first of
/// these, then each half at the next one, and so on. Whatever the others are, what becomes of a
/// face depends on the order of those in its own edges; so neighbours agree if their orders do.
/// Parts are oriented as the whole is.
template <class Visit>
void split_tetrahedron(const Tetrahedron& corners, std::span<const EdgeNode> nodes, Visit&& visit) {
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    std::size_t a = 4, b = 4;
    for (std::size_t k = 0; k < 4; ++k) {
      a = corners[k] == nodes[n].ends[0] ? k : a;
      b = corners[k] == nodes[n].ends[1] ? k : b;
    }
    if (a == 4 || b == 4)
      continue;
    Tetrahedron part = corners;
    part[b] = nodes[n].node;
    split_tetrahedron(part, nodes.subspan(n + 1), visit);
    part = corners;
    part[a] = nodes[n].node;
    split_tetrahedron(part, nodes.subspan(n + 1), visit);
    return;
  }
  visit(corners);
}

} // namespace gewebe::incision
