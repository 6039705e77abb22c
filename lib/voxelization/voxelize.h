#pragma once
// Exact scan conversion of triangle meshes by the parity rule: a sample point is inside if a ray
// from it crosses the surface an odd number of times (after Karabassi et al. 1999 the input is any
// mesh; FZKA 7190, 3.1.5 and 4.1).
//
// Points are taken to index space in double, once; from there on every decision is exact. Sample
// points that lie on the surface are decided as if all sample points were moved by (e1, e2, e3)
// with 1 >> e1 >> e2 >> e3 > 0: a half-open rule, so solids that touch share no sample point and
// leave none out, and every ray crosses a closed mesh an even number of times.

#include "geometry/mesh.h"
#include "volume/grid.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gewebe::voxelization {

/// What becomes of a mesh that has boundary edges.
enum class OpenMesh {
  refuse, ///< an Error with the counts, if the rule is parity
  skip,   ///< parity: rays with an odd number of crossings leave their samples outside
  fill,   ///< each hole is closed by a cone over its border to the mean of the border's points
};

/// When a sample point is inside.
enum class VoxelRule {
  parity,  ///< a ray from it crosses the surface an odd number of times
  winding, ///< |generalised winding number| > 1/2, parts turned outward (Jacobson et al. 2013)
  zbuffer, ///< along each axis it lies between the first and the last crossing (FZKA 7190, 3.1.5)
};

struct VoxelizeOptions {
  VoxelRule rule = VoxelRule::parity;
  /// 1: a voxel is its centre, value 0 or 1. N > 1: the mean of N³ samples at
  /// i - ½ + (2a+1)/(2N), a = 0 … N-1, along each axis of the voxel. 1 … 64.
  int samples = 1;
  OpenMesh on_open = OpenMesh::refuse;
  bool keep_windings = false; ///< rule winding, samples == 1: also InsideScan::windings
};

/// What the scan did.
struct VoxelizeReport {
  std::uint64_t triangles = 0;         ///< given
  std::uint64_t triangles_skipped = 0; ///< no ray can meet their box
  std::uint64_t boundary_edges = 0;    ///< edges with an odd number of triangles
  std::uint64_t holes = 0;             ///< connected groups of such edges
  std::uint64_t odd_rays = 0;          ///< rays (along k) with an odd number of crossings
  std::uint64_t crossings = 0;         ///< of rays with triangles
  std::uint64_t exact_tests = 0;       ///< signs that needed exact arithmetic

  // Rule winding alone, as in oriented_surface.h:
  std::uint64_t parts = 0, parts_turned = 0, triangles_turned = 0, triangles_duplicate = 0;
  std::uint64_t samples_summed = 0; ///< near holes, where solid angles were added up
};

/// Winding numbers of leaves one above the other along k, equal in all of them.
struct WindingRun {
  Int3 origin{};          ///< of the lowest
  std::int32_t k_end = 0; ///< voxels, exclusive
  std::array<std::int16_t, volume::leaf_voxels> winding{};
};

/// The samples inside, kept as bits or counts: only what the surface touches is stored voxel by
/// voxel.
struct InsideScan {
  int samples = 1;
  std::vector<Int3> origins; ///< of leaves neither wholly outside nor inside, ascending
  std::vector<std::array<std::uint64_t, 8>>
      bits; ///< per leaf, if samples == 1: bit n of word w is offset 64 w + n
  std::vector<std::array<std::uint32_t, volume::leaf_voxels>>
      counts;                          ///< per leaf, if samples > 1: of samples³
  std::vector<volume::TileView> tiles; ///< wholly inside, dim 8 or 128, value 1
  /// Where winding numbers other than 0 and 1 occur, ascending by origin; elsewhere they are the
  /// bits. Near a hole they are rounded, 0 outside.
  std::vector<WindingRun> windings;
};

/// Bytes that `voxelize` will need at most for meshes of ordinary shape: from the surface's area in
/// voxels.
double voxelize_bytes(const TriangleMesh& mesh, const volume::GridTransform& transform,
                      int samples);

/// Which samples of the lattice are inside `mesh`. The result is the same for any number of
/// threads. \pre check_mesh(mesh) passes \throw Error if the mesh has no triangle, the lattice
/// isn't cubic, an index would leave ±2^30, the memory doesn't suffice, or the mesh is open and
/// options.on_open is `refuse`
InsideScan scan_inside(const Context& context, const TriangleMesh& mesh,
                       const volume::GridTransform& transform, const VoxelizeOptions& options,
                       VoxelizeReport* report = nullptr);

/// The scan as a fog volume: background 0, isovalue 0.5, active where the value isn't 0.
volume::Grid grid_from_scan(const Context& context, const InsideScan& scan,
                            const volume::GridTransform& transform);

/// Both. \throw Error as scan_inside
volume::Grid voxelize(const Context& context, const TriangleMesh& mesh,
                      const volume::GridTransform& transform, const VoxelizeOptions& options,
                      VoxelizeReport* report = nullptr);

} // namespace gewebe::voxelization
