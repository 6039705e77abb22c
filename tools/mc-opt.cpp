// mc-opt: volume -> triangle mesh of its isosurface.

#include "base/digest.h"
#include "formats/mesh_file.h"
#include "formats/volume_file.h"
#include "surface/marching_cubes.h"
#include "surface/mesh_check.h"
#include "surface/snapping.h"
#include "tools/cli.h"
#include "volume/resample.h"

using namespace gewebe;

namespace {

struct Arguments {
  std::string volume = "-", place = "mean";
  std::optional<double> isovalue, voxel;
  double epsilon = SnapOptions{}.epsilon;
};

double reduction(std::uint64_t before, std::uint64_t after) {
  return before == 0 ? 0 : 1 - static_cast<double>(after) / static_cast<double>(before);
}

void report_work(cli::Stats& stats, const Grid& grid, const IsoSurface& surface,
                 const SnapReport& snapped) {
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
}

void report_mesh(cli::Stats& stats, const TriangleMesh& mesh) {
  const MeshReport report = examine_mesh(mesh);
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
  stats.set("edge_min", report.edge_min);
  stats.set("edge_mean", report.edge_mean);
  stats.set("edge_max", report.edge_max);
  Digest digest;
  digest.add(mesh.points);
  digest.add(mesh.triangles);
  stats.set("digest", digest.hex());
}

void work(cli::Run& run, const Arguments& arguments) {
  const Kind kind = output_kind(run.to(), run.output(), Kind::ply, writable_mesh_kinds());
  Output output(run.output(), run.output_options(is_binary(kind)));
  Input input(arguments.volume);
  const Context& context = run.context();
  Grid grid = run.timed("read", [&] { return read_volume(input, context); });
  const IsoSurface surface = at(input.name(), [&] {
    if (arguments.voxel)
      grid = run.timed(
          "resample", [&] { return resample(context, grid, uniform_transform(*arguments.voxel)); });
    return run.timed("marching_cubes",
                     [&] { return marching_cubes(context, grid, arguments.isovalue); });
  });
  SnapOptions options;
  options.epsilon = arguments.epsilon;
  options.place =
      arguments.place == "corner" ? SnapOptions::Place::corner : SnapOptions::Place::mean;
  const SnapResult snapped = run.timed("snap", [&] { return snap(context, surface, options); });
  run.timed("write", [&] { write_mesh(output, snapped.mesh, kind); });
  output.commit();
  if (snapped.mesh.triangles.empty())
    run.warn("the surface is empty: no value lies across the isovalue from another");

  run.say(std::to_string(snapped.report.points_before) + " points, " +
          std::to_string(snapped.report.points_after) + " after snapping");
  report_work(run.stats(), grid, surface, snapped.report);
  if (run.stats_wanted())
    run.timed("examine", [&] { report_mesh(run.stats(), snapped.mesh); });
}

} // namespace

int main(int argc, char** argv) {
  cli::Program program("mc-opt",
                       "Turns a volume into a closed triangle mesh of its isosurface, with "
                       "fewer and better triangles than marching cubes alone.");
  Arguments arguments;
  program.option("--iso", arguments.isovalue, "V",
                 "inside is above V (in a level set: below); default: the volume's own");
  program
      .option("--epsilon", arguments.epsilon, "E",
              "merge points within E voxel edges of a voxel centre")
      .range(0, 0.5);
  program
      .option("--place", arguments.place, "WHERE",
              "put merged points at their mean or at the voxel centre (corner)")
      .one_of({"mean", "corner"});
  program.option("--resample", arguments.voxel, "S", "first bring the volume to voxels of S mm")
      .positive();
  program.output_kinds(writable_mesh_kinds());
  program.operand("VOLUME", arguments.volume, "OpenVDB volume");
  return program.run(argc, argv, [&](cli::Run& run) { work(run, arguments); });
}
