#pragma once
// Marching cubes over a sparse volume: a closed triangle mesh of the isosurface.

#include "base/context.h"
#include "geometry/mesh.h"
#include "volume/grid.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace gewebe::surface {

/// Where the surface crosses an edge of the lattice: at index `corner` + fraction · e_axis.
struct EdgeCrossing {
  Int3 corner{};
  std::int32_t axis = 0;
  double fraction = 0; ///< 0 … 1; 0 or 1 where the value at that end equals the isovalue
};

/// The place of a crossing in index space.
Vec3 index_position(const EdgeCrossing& crossing);

struct SurfaceBlocks;

/// The mesh, and where the surface crosses the lattice.
struct IsoSurface {
  TriangleMesh mesh;
  volume::GridTransform transform;
  std::shared_ptr<const SurfaceBlocks> lattice; ///< what `snap` works on, whatever became of `mesh`
  std::uint64_t leaves = 0;                     ///< of the grid
  std::uint64_t leaves_visited =
      0;                    ///< of these, with a crossed cell among the cells of their voxels
  std::uint64_t blocks = 0; ///< blocks of 8³ cells with a crossed cell, in leaves or between tiles
  std::uint64_t active_cells = 0; ///< cells that the surface crosses
};

/// The lattice edges that the points of the mesh lie on, one per point in their order.
std::vector<EdgeCrossing> edge_crossings(const IsoSurface& surface);

/// Default isovalue of `grid`: info().isovalue, 0 for a level set.
double default_isovalue(const volume::GridInfo& info);

/// Triangulates the surface between inside and outside (Lorensen and Cline 1987; the table of
/// marching_cubes_table.h). Voxel centres are the corners of the cells. Inside is value > isovalue,
/// for a level set value < isovalue; a value equal to it is outside. What no leaf and no tile
/// covers has the background value.
///
/// The mesh is closed, 2-manifold and oriented: faces are counter-clockwise seen from outside,
/// under mirroring transforms too. If the background is inside, the mesh bounds the cavities, is
/// closed as well and has a negative signed volume. Crossings are interpolated along lattice edges
/// in double and in index space; points at equal index positions (where values equal the isovalue)
/// are separate points of the mesh, which `snap` joins.
///
/// Order: blocks of 8³ cells by (i, j, k) of their origin; in a block points by i, then axis, then
/// j, k; triangles by i, j, k of their cell. It depends on the values alone, neither on the number
/// of threads nor on what is a leaf and what a tile. Work and memory follow the surface.
///
/// \param isovalue in place of the grid's own
/// \throw Error if the transform is singular or not finite; if the grid is exact only near another
/// isovalue (band_isovalue); if indices come near the limits of 32 bits; if a value beside the
/// surface is not finite; if points or triangles exceed 2^32 - 2; if context.max_memory would not
/// do
IsoSurface marching_cubes(const Context& context, const volume::Grid& grid,
                          std::optional<double> isovalue = {});

/// The same surface for `snap` alone: its mesh, which `snap` doesn't need, is left empty.
IsoSurface marching_cubes_to_snap(const Context& context, const volume::Grid& grid,
                                  std::optional<double> isovalue = {});

} // namespace gewebe::surface
