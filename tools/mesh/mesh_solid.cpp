#include "base/error.h"
#include "formats/tetrahedra/tet_file.h"
#include "stuffing/stuffing.h"
#include "stuffing/surface_distance.h"
#include "surface/marching_cubes.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/components.h"
#include "tools/mesh/material_volumes.h"
#include "tools/mesh/mesh_work.h"
#include "tools/mesh/prepared_volume.h"
#include "tools/mesh/surface_choice.h"
#include "tools/mesh/tet_report.h"
#include "tools/volume/topology_change.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gewebe::cli {
namespace {

/// What was lost of the volume's own surface, and how far the boundary lies from it.
void compare_surface(cli::Run& run, const PreparedVolume& prepared,
                     const stuffing::StuffingOptions& options, const TriangleMesh& surface) {
  const Context& context = run.context();
  const double volume =
      signed_volume(surface::marching_cubes(context, prepared.grid, prepared.isovalue).mesh);
  run.stats().set("volume_isosurface", volume);
  const stuffing::SurfaceDistance distance =
      stuffing::surface_distance(context, prepared.grid, options, surface);
  run.stats().set("distance_max", distance.largest);
  run.stats().set("distance_mean", distance.mean);
  run.stats().set("beyond_cell", distance.beyond_cell);
}

void report_stuffing(cli::Stats& stats, const stuffing::StuffingReport& report, bool follows) {
  stats.set("cell", report.cell);
  stats.set("cut_nodes", report.cut_nodes);
  stats.set("warped_nodes", report.warped);
  stats.set("refused_warps", report.refused_warps);
  stats.set("largest_shift", report.largest_shift);
  if (!follows)
    return;
  stats.set("interface_cuts", report.interface_cuts);
  stats.set("interface_warped", report.interface_warped);
  stats.set("interface_kept", report.interface_kept);
}

} // namespace

void mesh_solid(cli::Run& run, const MeshArguments& arguments) {
  const formats::Kind kind = formats::output_kind(run.to(), run.output(), formats::Kind::ply,
                                                  formats::writable_tet_kinds());
  formats::Output output(run.output(), run.output_options(formats::is_binary(kind)));
  formats::Input input(arguments.volume);
  MaterialVolumes materials(arguments);
  const PreparedVolume prepared = prepare(run, arguments, input);
  run.timed("materials", [&] { materials.read(run, prepared.space); });
  const stuffing::StuffingOptions options{prepared.isovalue,
                                          arguments.cell,
                                          static_cast<unsigned>(arguments.grade),
                                          materials.source(prepared.grid, prepared.isovalue),
                                          arguments.interface == "follow",
                                          refined_regions(arguments)};
  stuffing::StuffingReport report;
  tetrahedra::TetMesh mesh = at(input.name(), [&] {
    return run.timed(
        "stuff", [&] { return stuffing::stuff(run.context(), prepared.grid, options, &report); });
  });
  cli::Stats& stats = run.stats();
  report_stuffing(stats, report, options.follow_interface);
  run.say(std::to_string(mesh.tetrahedra.size()) + " tetrahedra, " +
          std::to_string(mesh.points.size()) + " points");
  const bool comparable = prepared.before && prepared.before->components > 0;
  warn_if_empty(run, mesh.tetrahedra.empty() && !comparable);
  if (comparable)
    cli::compare_topology(run, "mc-opt", "", arguments.cell ? "--cell" : "--resample",
                          *prepared.before, mesh::topology(tetrahedra::boundary(mesh).mesh),
                          arguments.cell ? "cells" : "voxels");
  if (!arguments.components.empty()) {
    const tetrahedra::TetComponentReport kept =
        tetrahedra::keep_components(mesh, component_choice(arguments.components));
    stats.set("components_dropped", kept.dropped);
    stats.set("tetrahedra_dropped", kept.dropped_tetrahedra);
    stats.set("volume_dropped", kept.dropped_volume);
    stats.set("largest_dropped", kept.largest_dropped);
    warn_of_components(run, kept.kept, kept.dropped);
  }
  const std::vector<Vec3> as_in_volume = mesh.points;
  bring_to_space(run, prepared.space, arguments, mesh.points);
  run.timed("write", [&] {
    formats::write_tet_mesh(output, mesh, kind, run.output_options(formats::is_binary(kind)));
  });
  output.commit();
  if (run.stats_wanted())
    run.timed("examine", [&] {
      mesh.points = as_in_volume; // beside which its distances are measured
      const TriangleMesh surface = cli::report_tetrahedra(run, mesh);
      if (!mesh.tetrahedra.empty())
        compare_surface(run, prepared, options, surface);
    });
}

} // namespace gewebe::cli
