#pragma once
// How far a boundary lies from the isosurface that it stands for.

#include "base/context.h"
#include "geometry/mesh.h"
#include "stuffing/stuffing.h"
#include "volume/grid.h"

#include <cstdint>

namespace gewebe::stuffing {

/// From the middle of each triangle along its normal to where the volume passes the isovalue.
struct SurfaceDistance {
  double largest = 0, mean = 0; ///< mm; the mean is weighted by area
  std::uint64_t beyond_cell =
      0; ///< triangles from which nothing was found within a cell: not in the mean
};

/// \param surface the boundary of stuff() with the same options
/// \throw Error as stuff()
SurfaceDistance surface_distance(const Context& context, const volume::Grid& grid,
                                 const StuffingOptions& options, const TriangleMesh& surface);

} // namespace gewebe::stuffing
