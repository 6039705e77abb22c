#pragma once
// Improvement of the triangles of an isosurface: edges are flipped, and points slide along it.

#include "base/context.h"
#include "geometry/mesh.h"
#include "volume/grid.h"

#include <cstdint>

namespace gewebe::surface {

struct RegularizeOptions {
  int rounds = 10;
};

struct RegularizeReport {
  std::uint64_t flips = 0;
  std::uint64_t moves = 0;         ///< of points, counted in each round
  std::uint64_t refused_moves = 0; ///< moves that would have turned a face or made an angle smaller
  std::uint64_t off_surface = 0;   ///< points for which no position on the surface was found
  std::uint64_t kept_points = 0;   ///< not moved, because the mesh would have cut itself near them
};

/// Improves the angles of an isosurface. In each round
/// 1. an edge is flipped if three conditions hold. The smallest angle of its two faces grows. The
///    two faces lie nearly in one plane (their normals within 30 degrees, before and after). The
///    new edge is not in the mesh yet;
/// 2. a point moves half the way to the area-weighted mean of the centres of its faces, along the
///    tangent plane only. From there it moves along the gradient to the isovalue of the volume's
///    trilinear interpolation, at most a voxel away (Botsch and Kobbelt 2004). A move is tried at
///    half its length, and then refused, if it would turn a face by 45 degrees or more. The same
///    holds if it would lower the smallest angle round the point, and to less than 30 degrees.
///
/// The result could cut itself where the surface is less than a voxel from itself. There the points
/// of the faces concerned, their neighbours, and the edges between them are left as they were, and
/// everything is done again, with wider rings of neighbours if necessary. The result has no
/// self-intersections except near those of the given mesh.
///
/// Number and order of points stay the same. The mesh stays closed, 2-manifold and oriented, with
/// the same Euler number and components. A point that never moves stays at its position after
/// snapping. The result does not depend on the number of threads.
///
/// \pre mesh is the isosurface of grid at isovalue, closed, 2-manifold, oriented; the transform is
/// invertible
/// \throw Error if rounds is negative or context.max_memory would not do
RegularizeReport regularize(const Context& context, const volume::Grid& grid, double isovalue,
                            TriangleMesh& mesh, const RegularizeOptions& options);

} // namespace gewebe::surface
