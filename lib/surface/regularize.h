#pragma once
// Better triangles on the same isosurface: edges are flipped and points slide along it.

#include "base/context.h"
#include "base/mesh.h"
#include "volume/grid.h"

#include <cstdint>

namespace gewebe {

struct RegularizeOptions {
  int rounds = 10;
};

struct RegularizeReport {
  std::uint64_t flips = 0;
  std::uint64_t moves = 0;         ///< of points, counted in each round
  std::uint64_t refused_moves = 0; ///< that would have turned a face or made an angle smaller
  std::uint64_t off_surface = 0;   ///< points from where no place on the surface was found
  std::uint64_t kept_points = 0;   ///< left alone, since the mesh would have cut itself near them
};

/// Improves the angles of an isosurface. In each round
/// 1. an edge is flipped where the smallest angle of its two faces grows, the two faces lie nearly
///    in one plane (their normals within 30 degrees, before and after), and the new edge is not in
///    the mesh yet;
/// 2. a point moves half the way to the area-weighted mean of the centres of its faces, along the
///    tangent plane only, and from there along the gradient of the volume to where the volume's
///    trilinear interpolation has the isovalue, at most a voxel away (Botsch and Kobbelt 2004). A
///    move that would turn a face by 45 degrees or more, or bring the smallest angle round the
///    point below what it was (and below 30 degrees), is tried at half its length and then refused.
///
/// Where the result would cut itself (the surface is less than a voxel from itself there), the
/// points of the faces concerned and their neighbours, in ever wider rings if need be, and the
/// edges between them are left as they were, and all is done again: the result has no
/// self-intersection away from those that the mesh had.
///
/// Number and order of points stay, the mesh stays closed, 2-manifold and oriented with the same
/// Euler number and components. A point that never moves stays where snapping put it.
/// The result does not depend on the number of threads.
///
/// \pre mesh is the isosurface of grid at isovalue, closed, 2-manifold, oriented; the transform is
/// invertible
/// \throw Error if rounds is negative or context.max_memory would not do
RegularizeReport regularize(const Context& context, const Grid& grid, double isovalue,
                            TriangleMesh& mesh, const RegularizeOptions& options);

} // namespace gewebe
