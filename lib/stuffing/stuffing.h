#pragma once
// Tetrahedra from a volume by isosurface stuffing.

#include "base/context.h"
#include "tetrahedra/refinement.h"
#include "tetrahedra/tet_mesh.h"
#include "volume/grid.h"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace gewebe::stuffing {

/// A cut point nearer to a lattice point than this share of its edge is warped to. With these two
/// shares every dihedral angle of every stencil lies between stuffing_angle_min and -_max; the
/// enumeration is tests/unit/test_stuffing_angles.cpp.
inline constexpr double stuffing_alpha_long = 0.285, stuffing_alpha_short = 0.3985;
/// Degrees.
inline constexpr double stuffing_angle_min = 10.7, stuffing_angle_max = 164.8;

/// The same for cells of several sizes at the boundary, for points with cells of different sizes
/// round them: distances along axes, diagonals of faces and of cubes. They are shares of the edge
/// of the smallest cell at a corner, or of the cell at its centre. The proof is
/// tests/unit/test_stuffing_refined_angles.cpp.
inline constexpr std::array<double, 3> refined_alpha_corner{0.25, 0.2, 0.25},
    refined_alpha_centre{0.22, 0.2, 0.24};
inline constexpr double stuffing_refined_angle_min = 1.3, stuffing_refined_angle_max = 175.5;

/// Inside cells can be up to 2^3 times as large.
inline constexpr unsigned stuffing_grade_max = 3;

/// The material at a place of the world, mm; for one thread. It may throw Error.
using MaterialAt = std::function<std::int32_t(const Vec3&)>;
/// Makes one for a thread.
using MaterialSource = std::function<MaterialAt()>;

/// The interface between two materials followed by cuts has smaller angles than the boundary, where
/// a quadrilateral of cuts has one diagonal for both sides. By sampling, in the same test.
inline constexpr double stuffing_interface_angle_min = 8.4;

struct StuffingOptions {
  std::optional<double> isovalue; ///< in place of the grid's own
  /// Distance in mm of lattice points along an axis; nothing: the edge of a cube as large as a
  /// voxel.
  std::optional<double> cell;
  /// How often cells double inwards, 0 … stuffing_grade_max. What touches a point with an edge to
  /// the other side stays as it is with 0, so that the boundary is the same, triangle by triangle.
  unsigned grade = 0;
  MaterialSource materials = {}; ///< nothing: the mesh has none
  /// Do faces follow the interface between materials? Else a tetrahedron has the material of its
  /// centroid, so that the interface runs along faces of the lattice.
  bool follow_interface = false;
  /// Where cells are smaller: halved until they are small enough, one step at a time from one cell
  /// to the next.
  std::vector<tetrahedra::RefinedRegion> refine = {};
};

struct StuffingReport {
  double cell = 0;                    ///< mm
  std::uint64_t surface_nodes = 0;    ///< the first so many points lie on the boundary
  std::uint64_t cut_nodes = 0;        ///< of these, in the middle of an edge of the lattice
  std::uint64_t warped = 0;           ///< of these, lattice points that were moved onto the surface
  std::uint64_t refused_warps = 0;    ///< where a warp would have joined sheets of the boundary
  double largest_shift = 0;           ///< of a boundary node from the surface because of that, mm
  std::uint64_t interface_cuts = 0;   ///< nodes where an interface that is followed cuts an edge
  std::uint64_t interface_warped = 0; ///< lattice points that were moved onto it
  std::uint64_t interface_kept =
      0; ///< that it comes to instead: at the boundary, at a third material
};

/// The solid inside the isosurface as tetrahedra (Labelle and Shewchuk, Isosurface Stuffing: Fast
/// Tetrahedral Meshes with Good Dihedral Angles, 2007): a body-centred cubic lattice; where the
/// surface cuts one of its edges close to a lattice point, that point is moved there; what is left
/// is cut by stencils. Inside is value > isovalue, for a level set value < isovalue, in between
/// voxel centres by trilinear interpolation; cut points are roots of that along the edge (one,
/// where there are several).
///
/// The lattice of a grid with cubic voxels has its axes and its origin, so that with `cell` at the
/// voxel's edge lattice points are voxel centres; that of any other grid has the axes of the world.
/// What is smaller than a cell can be lost.
///
/// Every dihedral angle lies between stuffing_angle_min and stuffing_angle_max, every tetrahedron
/// has a positive volume, and the boundary consists of closed 2-manifolds. A warp that would
/// violate this is undone: one after which the tetrahedra at a point form neither a ball nor half a
/// ball. Cut points near that point are then moved away from it along their edges, to alpha at
/// most.
///
/// With `grade` the inside is an octree whose leaves double inwards, of neighbours across a face or
/// an edge by one step at most (section 3 of the paper). Between them stand halves of tetrahedra,
/// halves of pyramids and path tetrahedra, with dihedral angles of 45 to 120 degrees, so that the
/// bounds hold as without.
///
/// With `follow_interface` the inside is cut by the same stencils on both sides of an interface
/// between two materials, which so share their faces; lattice points close to it are moved onto it.
/// The boundary is that of the mesh without materials. Where the interface comes to points beside
/// the boundary, or three materials meet, it runs along faces of the lattice. The least angle is
/// stuffing_interface_angle_min.
///
/// With `refine` the leaves of the octree are smaller in its regions, at the boundary too, and
/// those that share a corner differ by one step at most. The surface then cuts halves of
/// tetrahedra, halves of pyramids and path tetrahedra as well; the stencils are the same, and
/// diagonals end at the cut on the longer edge. Points with leaves of one size round them are
/// warped as above, others over refined_alpha_corner and refined_alpha_centre. The angles lie
/// between stuffing_refined_angle_min and stuffing_refined_angle_max. The interface between
/// materials is not followed.
///
/// Nodes on the boundary come first, then lattice points inside, then nodes on interfaces, each in
/// the order of blocks of 8³ cells by (i, j, k); the mesh does not depend on the number of threads.
/// Work and memory follow the solid.
///
/// \throw Error if the transform is singular or not finite; if the grid is exact only near another
/// isovalue (band_isovalue); if its background is inside, so that nothing bounds the solid; if a
/// value at or beside the surface is not finite; if `cell` isn't finite and above 0; if
/// `grade` is above its maximum; if indices come near the limits of 32 bits; beyond
/// context.max_memory; what `materials` throws
tetrahedra::TetMesh stuff(const Context& context, const volume::Grid& grid,
                          const StuffingOptions& options, StuffingReport* report = nullptr);

} // namespace gewebe::stuffing
