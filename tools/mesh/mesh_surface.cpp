#include "formats/mesh/mesh_file.h"
#include "surface/gradient_normals.h"
#include "surface/marching_cubes.h"
#include "surface/regularize.h"
#include "surface/snapping.h"
#include "tools/mesh/mesh_work.h"
#include "tools/mesh/prepared_volume.h"
#include "tools/mesh/surface_choice.h"
#include "tools/mesh/surface_report.h"
#include "tools/volume/topology_change.h"

#include <string>

namespace gewebe::cli {
namespace {

/// What the options ask for beyond the snapped mesh.
void refine(cli::Run& run, const MeshArguments& arguments, const volume::Grid& grid,
            double isovalue, TriangleMesh& mesh) {
  const Context& context = run.context();
  cli::Stats& stats = run.stats();
  if (!arguments.components.empty()) {
    const mesh::ComponentReport report =
        mesh::keep_components(mesh, component_choice(arguments.components));
    warn_of_components(run, report.kept, report.dropped);
    stats.set("components_dropped", report.dropped);
    stats.set("points_dropped", report.dropped_points);
    stats.set("triangles_dropped", report.dropped_triangles);
    stats.set("volume_dropped", report.dropped_volume);
    stats.set("largest_dropped", report.largest_dropped);
    stats.set("points", mesh.points.size());
    stats.set("triangles", mesh.triangles.size());
  }
  if (arguments.rounds > 0) {
    const surface::RegularizeReport report = run.timed("regularize", [&] {
      return surface::regularize(context, grid, isovalue, mesh,
                                 {static_cast<int>(arguments.rounds)});
    });
    stats.set("edges_flipped", report.flips);
    stats.set("moves", report.moves);
    stats.set("moves_refused", report.refused_moves);
    stats.set("points_kept", report.kept_points);
  }
  if (arguments.normals)
    stats.set("normals_of_faces", run.timed("normals", [&] {
      return surface::gradient_normals(context, grid, mesh).from_faces;
    }));
}

} // namespace

void mesh_surface(cli::Run& run, const MeshArguments& arguments) {
  const formats::Kind kind = formats::output_kind(run.to(), run.output(), formats::Kind::ply,
                                                  formats::writable_mesh_kinds());
  formats::Output output(run.output(), run.output_options(formats::is_binary(kind)));
  formats::Input input(arguments.volume);
  const Context& context = run.context();
  const PreparedVolume prepared = prepare(run, arguments, input);
  const surface::IsoSurface surface = at(input.name(), [&] {
    return run.timed("marching_cubes", [&] {
      return surface::marching_cubes_to_snap(context, prepared.grid, arguments.isovalue);
    });
  });
  surface::SnapOptions options;
  options.epsilon = arguments.epsilon.value_or(options.epsilon);
  options.place = arguments.place == "corner" ? surface::SnapOptions::Place::corner
                                              : surface::SnapOptions::Place::mean;
  surface::SnapResult snapped =
      run.timed("snap", [&] { return surface::snap(context, surface, options); });
  cli::report_meshing(run.stats(), prepared.grid, surface, snapped.report);
  run.say(std::to_string(snapped.report.points_before) + " points, " +
          std::to_string(snapped.report.points_after) + " after snapping");
  if (snapped.report.kept_corners > 0)
    run.say("points stay at " + std::to_string(snapped.report.kept_corners) +
            " voxel centres, where the surface would cut itself");
  if (snapped.report.cutting_faces > 0)
    run.say(std::to_string(snapped.report.cutting_faces) +
            " triangles cut or touch each other, as where values equal the isovalue");
  warn_if_empty(run, snapped.mesh.triangles.empty());
  if (!snapped.mesh.triangles.empty() && prepared.before)
    cli::compare_topology(run, "mc-opt", "", "--resample", *prepared.before,
                          mesh::topology(snapped.mesh), "voxels");
  refine(run, arguments, prepared.grid, prepared.isovalue, snapped.mesh);
  bring_to_space(run, prepared.space, arguments, snapped.mesh.points, &snapped.mesh.normals);
  run.timed("write", [&] { formats::write_mesh(output, snapped.mesh, kind); });
  output.commit();
  if (run.stats_wanted())
    run.timed("examine", [&] { report_surface(run, snapped.mesh, arguments.self_intersections); });
}

} // namespace gewebe::cli
