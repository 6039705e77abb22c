#include "tools/mesh/surface_report.h"

#include "base/digest.h"
#include "mesh/check.h"
#include "mesh/quality.h"
#include "mesh/self_intersections.h"

namespace gewebe::cli {
namespace {

double reduction(std::uint64_t before, std::uint64_t after) {
  return before == 0 ? 0 : 1 - static_cast<double>(after) / static_cast<double>(before);
}

void set(Stats& stats, const char* key, const mesh::Histogram& histogram) {
  Stats& object = stats.object(key);
  object.set("top", histogram.top);
  object.set("counts", histogram.counts);
}

} // namespace

void report_meshing(Stats& stats, const volume::Grid& grid, const surface::IsoSurface& surface,
                    const surface::SnapReport& snapped) {
  stats.set("voxels", grid.active_voxels());
  stats.set("leaves", surface.leaves);
  stats.set("leaves_visited", surface.leaves_visited);
  stats.set("leaves_skipped", surface.leaves - surface.leaves_visited);
  stats.set("active_cells", surface.active_cells);
  stats.set("points_unsnapped", snapped.points_before);
  stats.set("points", snapped.points_after);
  stats.set("point_reduction", reduction(snapped.points_before, snapped.points_after));
  stats.set("triangles_unsnapped", snapped.triangles_before);
  stats.set("triangles", snapped.triangles_after);
  stats.set("triangle_reduction", reduction(snapped.triangles_before, snapped.triangles_after));
  stats.set("fins", snapped.fins);
  stats.set("refused_collapses", snapped.refused);
  stats.set("corners_kept", snapped.kept_corners);
}

void report_surface(Run& run, const TriangleMesh& mesh, bool self_intersections) {
  Stats& stats = run.stats();
  mesh::MeshQuality quality;
  const mesh::MeshReport report = mesh::examine_mesh(mesh, run.context(), &quality);
  stats.set("closed", report.closed());
  stats.set("manifold", report.manifold());
  stats.set("oriented", report.oriented());
  stats.set("outward", report.outward());
  stats.set("euler", report.euler);
  stats.set("components", report.components);
  stats.set("volume", report.volume);
  stats.set("area", report.area);
  stats.set("zero_area_faces", report.zero_area_faces);
  stats.set("smallest_angle", report.smallest_angle);
  stats.set("angle_1_percent", quality.angle_1_percent);
  stats.set("angle_5_percent", quality.angle_5_percent);
  stats.set("angle_median", quality.angle_median);
  stats.set("angles_below_10", quality.share_below_10);
  stats.set("edge_min", report.edge_min);
  stats.set("edge_mean", report.edge_mean);
  stats.set("edge_max", report.edge_max);
  stats.set("explicit_step", quality.explicit_step);
  set(stats, "smallest_angles", quality.smallest_angles);
  set(stats, "edge_lengths", quality.edge_lengths);
  set(stats, "areas", quality.areas);
  if (self_intersections) {
    const mesh::SelfIntersections found = gewebe::mesh::self_intersections(run.context(), mesh);
    stats.set("self_intersections", found.pairs);
    stats.set("self_intersecting_faces", std::uint64_t{found.faces.size()});
  }
  Digest digest;
  digest.add(mesh.points);
  digest.add(mesh.triangles);
  if (!mesh.normals.empty())
    digest.add(mesh.normals);
  stats.set("digest", digest.hex());
}

} // namespace gewebe::cli
