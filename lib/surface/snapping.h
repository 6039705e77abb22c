#pragma once
// Snapping: points of an isosurface near a corner of the lattice are merged there, for fewer and
// better triangles. The mesh stays valid (report FZKA 7190, section 3.1.4).

#include "base/context.h"
#include "geometry/mesh.h"
#include "surface/marching_cubes.h"

#include <cstdint>

namespace gewebe::surface {

struct SnapOptions {
  /// Where merged points go: to the mean of their crossings, weighted by 1 - 1.5 d where d is the
  /// distance to the nearer end of the edge, or to the corner as in the report. The weights cost
  /// vertices at epsilon 0.5 some 4 % of their accuracy and give 2 degrees of the smallest angles.
  enum class Place { mean, corner };
  double epsilon = 0.15; ///< 0 … 0.5, fraction of the lattice edge
  Place place = Place::mean;
  bool may_cut = false; ///< leaves faces that cut each other, see `snap`
};

struct SnapReport {
  std::uint64_t points_before = 0, points_after = 0;
  std::uint64_t triangles_before = 0, triangles_after = 0;
  std::uint64_t corners = 0;       ///< lattice corners that drew a crossing
  std::uint64_t fins = 0;          ///< points that snapped by the fin rule
  std::uint64_t refused = 0;       ///< edges inside a cluster that the link condition kept
  std::uint64_t zero_area = 0;     ///< faces left whose area is 0, relative to their longest edge
  std::uint64_t kept_corners = 0;  ///< whose points stay, since faces cut each other there
  std::uint64_t cutting_faces = 0; ///< left that cut each other
};

struct SnapResult {
  TriangleMesh mesh;
  SnapReport report;
};

/// Snaps the points of an isosurface to the corners of its lattice.
///
/// 1. A crossing at distance <= epsilon from a corner joins that corner's cluster; at 0.5 from both
///    corners it joins the lower one. Epsilon 0 joins the crossings that lie exactly on a corner.
/// 2. Fin rule: a point outside all clusters whose neighbours lie in at most two clusters would be
///    left with two opposite faces or none; it joins the nearer of the two.
/// 3. Each cluster, in the order of its first point, is collapsed edge by edge where the link
///    condition holds (Dey et al. 1999): the ends have exactly two common neighbours, and the
///    component is no tetrahedron. So the mesh stays closed, 2-manifold and oriented, with the same
///    Euler number and components, without equal faces or faces with equal corners.
///
/// Edges that the link condition refuses stay, for example the last tetrahedron of a component that
/// lies in one cluster. Place::mean moves only merged points, Place::corner every point of a
/// cluster (but no point of a fin on its own).
///
/// With Place::corner, faces between corners in one line have no area. Their longest edge is
/// flipped (flip_flat_faces). If no flip helps, because points coincide, these points get the
/// positions of Place::mean. Faces that are still flat are counted.
///
/// Faces of the result may cut each other, as across a wall thinner than a voxel. Their corners
/// then draw only points that lie on them, and everything is done again while the number of such
/// faces decreases. Three kinds of faces are compared: those with a point of a corner that keeps
/// several points (with Place::corner: where the surface isn't a single sheet), those turned out of
/// their cell's direction, and those beside one of these. No other face was seen to cut.
///
/// Points and triangles keep the order of their first member; unused points vanish. Linear time.
///
/// The input is surface.lattice, from marching_cubes or marching_cubes_to_snap; the mesh of the
/// surface is not used. Most clusters are merged in parallel; the result is the same bytes for any
/// number of threads.
///
/// \throw Error if epsilon is not within 0 … 0.5, or if context.max_memory would not do
SnapResult snap(const Context& context, const IsoSurface& surface, const SnapOptions& options);

} // namespace gewebe::surface
