#pragma once
// The part of a surface that something can reach in a step. Where columns of the compliance are
// compressed by clusters of nodes, displacements can be computed for a few clusters alone and are
// bounded for all others (statics/elastostatic.h). So contact with a small instrument costs as much
// on a large surface as on a small one.

#include "columns/node_clusters.h"
#include "contact/island.h"
#include "geometry/vec3.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gewebe::statics {

/// Part of a surface, with what its displacement is found from.
struct SurfacePatch {
  contact::ModelSurface surface;
  std::vector<std::uint32_t> clusters; ///< of its nodes, ascending
  std::vector<std::uint32_t> node;     ///< of the clusters, one behind the other
  std::vector<std::uint32_t> place;    ///< by vertex: of its node among these
};

/// A surface as tiles of some neighbouring triangles.
class SurfaceTiles {
public:
  /// Keeps both by reference. \param clusters  hold each node of the surface
  SurfaceTiles(const contact::ModelSurface& surface, const columns::NodeClusters& clusters);

  /// Tiles that may meet one of these boxes, ascending.
  /// \param bounds  by cluster: of the displacement of its nodes, mm
  std::vector<std::uint32_t> near(std::span<const Box3> boxes,
                                  std::span<const double> bounds) const;
  /// Tiles that hold the vertices of these nodes, ascending.
  std::vector<std::uint32_t> with(std::span<const std::uint32_t> nodes) const;
  /// Box that holds the surface.
  Box3 box(std::span<const double> bounds) const;
  /// \param tiles  ascending
  SurfacePatch part(std::span<const std::uint32_t> tiles) const;

private:
  struct Tile {
    Box3 box; ///< at rest
    std::vector<std::uint32_t> triangles, clusters;

    double bound(std::span<const double> bounds) const;
  };
  const contact::ModelSurface& surface_;
  const columns::NodeClusters& clusters_;
  std::vector<Tile> tiles_;
  std::vector<std::uint32_t> cluster_, place_, tile_; ///< by vertex; place_: in the cluster
};

} // namespace gewebe::statics
