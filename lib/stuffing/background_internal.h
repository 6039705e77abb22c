#pragma once
// Tetrahedra between the leaves of an octree: the body-centred lattice with cells of several sizes,
// which a surface may cut anywhere; and how the isosurface cuts them. For the room and its tests.

#include "base/context.h"
#include "geometry/mesh.h"
#include "geometry/vec3.h"
#include "stuffing/lattice_internal.h"
#include "stuffing/octree_internal.h"
#include "stuffing/stuffing.h"
#include "stuffing/warp_internal.h"
#include "tetrahedra/tet_mesh.h"
#include "volume/grid.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::stuffing {

/// Conforming tetrahedra of positive volume round the edge between the centres of two leaves with a
/// common face (Labelle and Shewchuk 2007, section 3). In units of the smaller leaf's edge they are
/// - tetrahedra of the body-centred lattice between leaves of one size;
/// - halves of such, where the edge of a leaf has a node in its middle;
/// - between leaves of two sizes path tetrahedra towards the centre of the larger, halves of
///   pyramids towards that of the smaller one.
struct Background {
  struct Node {
    Int3 place{};                   ///< in halves of finest cells
    std::uint8_t level = UINT8_MAX; ///< of the smallest leaf that it belongs to
    bool centre = false;            ///< of a leaf
    bool even = false;              ///< all round it are tetrahedra of one lattice
  };
  std::vector<Node> nodes;
  std::vector<Tetrahedron> tetrahedra;
};

/// \pre the octree is balanced; places of its cells are below 2^29
/// \throw Error if there are more than 2^32 - 2 nodes or tetrahedra
Background background_of(const StuffingOctree& octree, unsigned block);

/// How near to a node the surface may cut an edge that leads along `step` (in halves of finest
/// cells), in these halves; below that the node is moved there.
double least_cut(const Background::Node& node, const Int3& step);

/// Edges that the surface cuts, and which of their ends are moved onto it.
struct BackgroundSurface {
  static constexpr std::uint32_t none = UINT32_MAX;
  struct Edge {
    std::uint32_t inside = 0, outside = 0;
    double cut = 0;                ///< the share of the way from inside
    double least = 0, largest = 1; ///< shares that are left to it while no end is moved
  };
  std::vector<bool> inside;         ///< by node
  std::vector<Edge> edges;          ///< by both ends
  std::vector<std::uint32_t> first; ///< by node: where its edges begin in `of_node`
  std::vector<std::uint32_t> of_node;
  std::vector<std::uint32_t> warp; ///< by node: the edge along which it is moved, or none
  std::vector<bool> refused;       ///< by node: a warp of it was undone

  bool warped(std::uint32_t node) const { return warp[node] != none; }
  int sign(std::uint32_t node) const { return warped(node) ? 0 : inside[node] ? 1 : -1; }
  bool is_cut(const Edge& edge) const { return !warped(edge.inside) && !warped(edge.outside); }
  std::span<const std::uint32_t> edges_of(std::uint32_t node) const {
    return std::span(of_node).subspan(first[node], first[node + 1] - first[node]);
  }
};

/// Tetrahedra of the background at nodes of the surface.
class NodeTetrahedra {
public:
  NodeTetrahedra(const Background& background, const BackgroundSurface& surface);
  std::span<const std::uint32_t> of(std::uint32_t node) const {
    return std::span(tetrahedra_).subspan(first_[node], first_[node + 1] - first_[node]);
  }

private:
  std::vector<std::uint32_t> first_, tetrahedra_;
};

/// How the inside meets a node that is moved onto the surface.
Meeting meeting(const Background& background, const BackgroundSurface& surface,
                const NodeTetrahedra& tetrahedra, std::uint32_t node);

/// In places of the lattice. \param levels how often cells are halved
Vec3 background_place(const Background::Node& node, unsigned levels);

/// Which nodes are inside. \throw Error if a value is not finite
std::vector<bool> inside_nodes(const Context& context, const volume::Grid& grid,
                               const StuffingLattice& lattice, const Background& background,
                               unsigned levels);

/// Finds the cuts and warps nodes as in warp_internal.h, one after the other by number.
BackgroundSurface warp_background(const Context& context, const volume::Grid& grid,
                                  const StuffingLattice& lattice, const Background& background,
                                  unsigned levels, std::vector<bool> inside);

/// The part inside. Fills in the report's counts.
tetrahedra::TetMesh cut_background(const StuffingLattice& lattice, const Background& background,
                                   unsigned levels, const BackgroundSurface& surface,
                                   StuffingReport& report);

} // namespace gewebe::stuffing
