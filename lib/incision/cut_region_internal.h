#pragma once
// Region near a blade: edges that it passes, tetrahedra that it separates, and all tetrahedra at
// the ends of such edges, with local node numbers.

#include "geometry/vec3.h"
#include "incision/cut_blade_internal.h"
#include "incision/cut_tetrahedra.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::incision {

inline constexpr std::uint32_t no_crossing = UINT32_MAX;

/// An edge that the blade passes, of a tetrahedron that it separates. Ends are local nodes, in the
/// order of their numbers.
struct CrossedEdge {
  std::array<std::uint32_t, 2> ends{};
  double share = 0; ///< from the first
  Vec3 point;       ///< at rest
  double length = 0;
  std::uint32_t rank = 0; ///< in the order in which edges are halved: long ones first
  std::uint32_t tet = 0;  ///< of the region, at it, the first
  std::uint32_t edge = 0; ///< of that (tetrahedron_edges)
};

/// A tetrahedron of the region.
struct RegionTet {
  std::uint32_t number = 0; ///< in the mesh
  Tetrahedron corners{};    ///< local nodes
  /// By edge (tetrahedron_edges): which crossed edge it is, or no_crossing.
  std::array<std::uint32_t, 6> crossing{};
  /// Of each corner where the blade separates them: 1 above, -1 below; else all 0.
  std::array<std::int8_t, 4> side{};
  bool touched = false; ///< the blade passes at least one edge

  bool separated() const { return side[0] != 0; }
  bool has_crossing() const {
    for (const std::uint32_t c : crossing)
      if (c != no_crossing)
        return true;
    return false;
  }
};

/// Tetrahedra and crossed edges near a blade.
struct CutRegion {
  std::vector<CrossedEdge> edges;   ///< by the numbers of their ends in the mesh
  std::vector<RegionTet> tets;      ///< ascending: all with an end of a crossed edge, or more
  std::vector<std::uint32_t> nodes; ///< of each local node its number in the mesh, ascending
  std::vector<std::uint32_t> first; ///< star[first[n] … first[n+1]) of a local node:
  std::vector<std::uint32_t> star;  ///< tetrahedra of the region at it, ascending
  std::vector<std::uint8_t> whole;  ///< by local node: 1 if all its tetrahedra are in the region
  std::uint64_t tested = 0, folded = 0;

  std::span<const std::uint32_t> star_of(std::uint32_t node) const {
    return std::span(star).subspan(first[node], first[node + 1] - first[node]);
  }
};

/// Finds the region near a blade.
/// \param wide  also the neighbours of the tetrahedra at the ends of crossed edges
/// \pre check_mesh(mesh) passes; options as for cut_tetrahedra
/// \throw Error as cut_tetrahedra
CutRegion cut_region(const tetrahedra::TetMesh& mesh, const BladeCutOptions& options,
                     const Blade& blade, bool wide);

} // namespace gewebe::incision
