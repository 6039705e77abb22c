// mc-opt: volume -> triangle mesh of its isosurface.

#include "formats/mesh/mesh_file.h"
#include "formats/volume/volume_file.h"
#include "mesh/components.h"
#include "surface/gradient_normals.h"
#include "surface/marching_cubes.h"
#include "surface/regularize.h"
#include "surface/snapping.h"
#include "tools/shared/cli.h"
#include "tools/shared/distrust.h"
#include "tools/shared/surface_choice.h"
#include "tools/shared/surface_report.h"
#include "volume/crop.h"
#include "volume/resample.h"

using namespace gewebe;

namespace {

struct Arguments {
  std::string volume = "-", place = "mean", components;
  std::optional<double> isovalue, voxel;
  std::vector<double> box; // x0 y0 z0 x1 y1 z1
  double epsilon = SnapOptions{}.epsilon;
  std::int64_t rounds = 0;
  bool normals = false, self_intersections = false;
};

/// What the options ask for beyond the snapped mesh.
void refine(cli::Run& run, const Arguments& arguments, const Grid& grid, double isovalue,
            TriangleMesh& mesh) {
  const Context& context = run.context();
  cli::Stats& stats = run.stats();
  if (!arguments.components.empty()) {
    const ComponentReport report = keep_components(mesh, component_choice(arguments.components));
    run.say(std::to_string(report.dropped) + " components dropped, " + std::to_string(report.kept) +
            " kept");
    if (report.kept == 0 && report.dropped > 0)
      run.warn("no component is as large as --components asks");
    stats.set("components_dropped", report.dropped);
    stats.set("points_dropped", report.dropped_points);
    stats.set("triangles_dropped", report.dropped_triangles);
    stats.set("volume_dropped", report.dropped_volume);
    stats.set("largest_dropped", report.largest_dropped);
    stats.set("points", mesh.points.size());
    stats.set("triangles", mesh.triangles.size());
  }
  if (arguments.rounds > 0) {
    const RegularizeReport report = run.timed("regularize", [&] {
      return regularize(context, grid, isovalue, mesh, {static_cast<int>(arguments.rounds)});
    });
    stats.set("edges_flipped", report.flips);
    stats.set("moves", report.moves);
    stats.set("moves_refused", report.refused_moves);
    stats.set("points_kept", report.kept_points);
  }
  if (arguments.normals)
    stats.set("normals_of_faces", run.timed("normals", [&] {
      return gradient_normals(context, grid, mesh).from_faces;
    }));
}

/// Of the surface that is asked for, on the volume as it came.
Topology topology_of(const Context& context, const Grid& grid, const Arguments& arguments) {
  if (arguments.box.empty())
    return topology(marching_cubes(context, grid, arguments.isovalue).mesh);
  const double isovalue = arguments.isovalue.value_or(default_isovalue(grid.info()));
  const Grid part = crop(context, grid, box_of(arguments.box), isovalue);
  return topology(marching_cubes(context, part, arguments.isovalue).mesh);
}

void compare_topology(cli::Run& run, const Topology& before, const Topology& after) {
  run.stats().set("components_before", before.components);
  run.stats().set("euler_before", before.euler);
  if (before == after)
    return;
  cli::distrust(run, "mc-opt",
                "--resample changes the surface from " + std::to_string(before.components) +
                    (before.components == 1 ? " component" : " components") + " and Euler number " +
                    std::to_string(before.euler) + " to " + std::to_string(after.components) +
                    " and " + std::to_string(after.euler) + ", expected the same of finer voxels");
}

void work(cli::Run& run, const Arguments& arguments) {
  const Kind kind = output_kind(run.to(), run.output(), Kind::ply, writable_mesh_kinds());
  Output output(run.output(), run.output_options(is_binary(kind)));
  Input input(arguments.volume);
  const Context& context = run.context();
  Grid grid = run.timed("read", [&] { return read_volume(input, context); });
  const double isovalue = arguments.isovalue.value_or(default_isovalue(grid.info()));
  std::optional<Topology> before;
  const IsoSurface surface = at(input.name(), [&] {
    if (arguments.voxel) {
      before = run.timed("topology", [&] { return topology_of(context, grid, arguments); });
      grid = run.timed(
          "resample", [&] { return resample(context, grid, uniform_transform(*arguments.voxel)); });
    }
    if (!arguments.box.empty())
      grid =
          run.timed("crop", [&] { return crop(context, grid, box_of(arguments.box), isovalue); });
    return run.timed("marching_cubes",
                     [&] { return marching_cubes_to_snap(context, grid, arguments.isovalue); });
  });
  SnapOptions options;
  options.epsilon = arguments.epsilon;
  options.place =
      arguments.place == "corner" ? SnapOptions::Place::corner : SnapOptions::Place::mean;
  SnapResult snapped = run.timed("snap", [&] { return snap(context, surface, options); });
  cli::report_meshing(run.stats(), grid, surface, snapped.report);
  run.say(std::to_string(snapped.report.points_before) + " points, " +
          std::to_string(snapped.report.points_after) + " after snapping");
  if (snapped.mesh.triangles.empty())
    cli::distrust(run, "mc-opt",
                  "the surface is empty: no value lies across the isovalue from another");
  else if (before)
    compare_topology(run, *before, topology(snapped.mesh));
  refine(run, arguments, grid, isovalue, snapped.mesh);
  run.timed("write", [&] { write_mesh(output, snapped.mesh, kind); });
  output.commit();
  if (run.stats_wanted())
    run.timed("examine", [&] { report_surface(run, snapped.mesh, arguments.self_intersections); });
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
  program
      .option("--bbox", arguments.box, "X0,Y0,Z0,X1,Y1,Z1",
              "only what lies in this box of the world, closed by its faces")
      .count(6);
  program.option("--components", arguments.components, "WHICH",
                 "keep only the largest components: largest, a number N, or min-volume:V mm3");
  program
      .option("--regularize", arguments.rounds, "N",
              "improve the triangles by N rounds of flips and sliding along the surface")
      .range(0, 1000);
  program.flag("--normals", arguments.normals, "write normals, from the gradient of the volume");
  program.flag("--self-intersections", arguments.self_intersections,
               "let --stats count the pairs of faces that cut each other");
  program.output_kinds(writable_mesh_kinds());
  program.operand("VOLUME", arguments.volume, "OpenVDB volume");
  program.check([&] {
    component_choice(arguments.components);
    box_of(arguments.box);
  });
  return program.run(argc, argv, [&](cli::Run& run) { work(run, arguments); });
}
