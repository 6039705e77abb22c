#pragma once
// Quality and statistics of a tetrahedral mesh.

#include "mesh/quality.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/tet_mesh.h"

#include <array>
#include <cstdint>
#include <vector>

namespace gewebe::tetrahedra {

/// Tetrahedra of one material.
struct MaterialShare {
  std::int32_t material = 0;
  std::uint64_t tetrahedra = 0;
  double volume = 0; ///< mm³
};

/// Of the corners alone, whatever the middles. A tetrahedron without volume has angles of 0 and 180
/// degrees and an infinite ratio.
struct TetQuality {
  std::uint64_t tetrahedra = 0;
  /// Dihedral angles, degrees, and whose they are (the first); 0 and 0 without tetrahedra.
  double smallest_angle = 0, largest_angle = 0;
  std::uint32_t smallest_angle_at = 0, largest_angle_at = 0;
  mesh::Histogram angles; ///< of all six of each tetrahedron: 18 bins of 10 degrees
  /// Largest ratio of the circumsphere's radius to the shortest edge (0.61 of a regular one).
  double radius_edge_ratio = 0;
  double volume = 0, smallest_volume = 0; ///< mm³, signed
  double edge_min = 0, edge_max = 0;      ///< mm
  std::uint64_t surface_nodes = 0;        ///< corners and middles on the boundary
  std::uint64_t inner_nodes = 0;          ///< other corners and middles
  std::vector<MaterialShare> materials;   ///< ascending; one, 0, if the mesh has none
};

/// \pre check_mesh(mesh) passes; `surface` == boundary(mesh)
TetQuality tet_quality(const TetMesh& mesh, const TetBoundary& surface);

/// The same, with the boundary found here.
TetQuality tet_quality(const TetMesh& mesh);

/// The dihedral angles at the edges (tetrahedron_edges) of one, radians, 0 … pi: the angle between
/// the normals of two faces by its sine and cosine, exact to a few units in the last place of
/// either, however flat.
std::array<double, 6> dihedral_angles(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Radius of the sphere through four points over the shortest distance between two of them.
double radius_edge_ratio(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

} // namespace gewebe::tetrahedra
