#pragma once
// Compares a scan with CGAL's exact point-in-mesh test. For units compiled with -frounding-math.

#include "mesh_fixtures.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

namespace gewebe::test {

/// What CGAL says of points in the index space of a lattice, to which the mesh is taken as the
/// voxelizer does.
class CgalSide {
public:
  CgalSide(const TriangleMesh& mesh, const volume::GridTransform& lattice)
      : surface_(surface_of(mesh, lattice)), side_(surface_) {}

  /// Faces that CGAL took; fewer than the mesh has where it isn't manifold.
  std::size_t faces() const { return surface_.number_of_faces(); }
  CGAL::Bounded_side at(const Int3& v) const { return side_(Kernel::Point_3(v[0], v[1], v[2])); }

private:
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

  static Mesh surface_of(const TriangleMesh& mesh, const volume::GridTransform& lattice) {
    Mesh surface;
    std::vector<Mesh::Vertex_index> vertex;
    for (const Vec3& point : mesh.points) {
      const Vec3 p = lattice.to_index(point);
      vertex.push_back(surface.add_vertex({p.x, p.y, p.z}));
    }
    for (const auto& [a, b, c] : mesh.triangles)
      surface.add_face(vertex[a], vertex[b], vertex[c]);
    return surface;
  }

  Mesh surface_;
  CGAL::Side_of_triangle_mesh<Mesh, Kernel> side_;
};

/// Membership of single voxels.
class ScanLookup {
public:
  explicit ScanLookup(const voxelization::InsideScan& scan) : scan_(scan) {
    for (std::size_t n = 0; n < scan.origins.size(); ++n)
      leaf_[scan.origins[n]] = n;
    for (const volume::TileView& t : scan.tiles)
      (t.dim == volume::leaf_dim ? tile_ : large_tile_).insert(t.origin);
  }
  bool inside(const Int3& v) const {
    const Int3 origin = volume::leaf_origin(v);
    if (const auto at = leaf_.find(origin); at != leaf_.end()) {
      const int n = volume::leaf_offset(v);
      return (scan_.bits[at->second][static_cast<std::size_t>(n / 64)] >> (n % 64) & 1) != 0;
    }
    return tile_.contains(origin) || large_tile_.contains({v[0] & ~127, v[1] & ~127, v[2] & ~127});
  }

private:
  const voxelization::InsideScan& scan_;
  std::map<Int3, std::size_t> leaf_;
  std::set<Int3> tile_, large_tile_;
};

struct SideCount {
  std::size_t inside = 0, wrong = 0, on_surface = 0;

  void add(CGAL::Bounded_side where, bool is_inside) {
    inside += is_inside;
    if (where == CGAL::ON_BOUNDARY)
      ++on_surface;
    else
      wrong += is_inside != (where == CGAL::ON_BOUNDED_SIDE);
  }
};

/// All voxels of [min, max].
inline SideCount compare_box(const CgalSide& side, const voxelization::InsideScan& scan,
                             const Int3& min, const Int3& max) {
  const ScanLookup lookup(scan);
  SideCount count;
  for (std::int32_t i = min[0]; i <= max[0]; ++i)
    for (std::int32_t j = min[1]; j <= max[1]; ++j)
      for (std::int32_t k = min[2]; k <= max[2]; ++k)
        count.add(side.at({i, j, k}), lookup.inside({i, j, k}));
  return count;
}

/// A solid of revolution about z: the closed profile (radius, z), anticlockwise with the radius to
/// the right, at `steps` angles. Radius 0 is a pole.
inline TriangleMesh revolved(const std::vector<std::array<double, 2>>& profile,
                             std::uint32_t steps) {
  TriangleMesh mesh;
  std::vector<std::vector<std::uint32_t>> rings;
  for (const auto& [radius, z] : profile) {
    std::vector<std::uint32_t> ring;
    for (std::uint32_t s = 0; s < steps; ++s) {
      if (radius > 0 || s == 0) {
        const double angle = 2 * std::acos(-1.0) * s / steps;
        mesh.points.push_back({radius * std::cos(angle), radius * std::sin(angle), z});
      }
      ring.push_back(static_cast<std::uint32_t>(mesh.points.size() - 1));
    }
    rings.push_back(ring);
  }
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const auto &low = rings[r], &high = rings[(r + 1) % rings.size()];
    for (std::uint32_t s = 0; s < steps; ++s) {
      const std::uint32_t t = (s + 1) % steps;
      if (low[s] != low[t])
        mesh.triangles.push_back({low[s], low[t], high[t]});
      if (high[s] != high[t])
        mesh.triangles.push_back({low[s], high[t], high[s]});
    }
  }
  return mesh;
}

/// A bottle with walls a third of a voxel thick, open at the top.
inline TriangleMesh thin_bottle() {
  const double wall = 0.3;
  return revolved({{0, -20},
                   {14, -20},
                   {14, 5},
                   {4, 14},
                   {4, 22},
                   {4 - wall, 22},
                   {4 - wall, 14},
                   {14 - wall, 5 - wall / 2},
                   {14 - wall, -20 + wall},
                   {0, -20 + wall}},
                  40);
}

} // namespace gewebe::test
