#include "tools/mesh/tet_report.h"

#include "base/digest.h"
#include "mesh/components.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/check.h"
#include "tetrahedra/components.h"
#include "tetrahedra/quality.h"

#include <utility>

namespace gewebe::cli {

TriangleMesh report_tetrahedra(Run& run, const tetrahedra::TetMesh& mesh) {
  Stats& stats = run.stats();
  tetrahedra::TetBoundary surface = tetrahedra::boundary(mesh);
  const tetrahedra::TetReport found = tetrahedra::examine_tetrahedra(mesh);
  const tetrahedra::TetQuality quality = tetrahedra::tet_quality(mesh, surface);
  stats.set("points", mesh.points.size());
  stats.set("tetrahedra", mesh.tetrahedra.size());
  stats.set("surface_nodes", quality.surface_nodes);
  stats.set("inner_nodes", quality.inner_nodes);
  stats.set("surface_triangles", surface.mesh.triangles.size());
  stats.set("sound", found.sound());
  stats.set("manifold", found.manifold_boundary());
  stats.set("components", tetrahedra::component_count(mesh));
  if (found.manifold_boundary())
    stats.set("euler", mesh::topology(surface.mesh).euler);
  stats.set("volume", quality.volume);
  stats.set("smallest_volume", quality.smallest_volume);
  stats.set("area", surface_area(surface.mesh));
  stats.set("smallest_angle", quality.smallest_angle);
  stats.set("largest_angle", quality.largest_angle);
  stats.set("radius_edge_ratio", quality.radius_edge_ratio);
  stats.set("edge_min", quality.edge_min);
  stats.set("edge_max", quality.edge_max);
  Stats& angles = stats.object("dihedral_angles");
  angles.set("top", quality.angles.top);
  angles.set("counts", quality.angles.counts);
  Stats& materials = stats.object("materials");
  for (const tetrahedra::MaterialShare& share : quality.materials) {
    Stats& material = materials.object(std::to_string(share.material));
    material.set("tetrahedra", share.tetrahedra);
    material.set("volume", share.volume);
  }
  Digest digest;
  digest.add(mesh.points);
  digest.add(mesh.tetrahedra);
  if (!mesh.material.empty())
    digest.add(mesh.material);
  stats.set("digest", digest.hex());
  return std::move(surface.mesh);
}

} // namespace gewebe::cli
