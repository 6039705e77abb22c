// mc-opt: volume -> triangle mesh of its isosurface, or tetrahedra of what lies inside.

#include "formats/mesh/mesh_file.h"
#include "formats/tetrahedra/tet_file.h"
#include "formats/volume/volume_file.h"
#include "mesh/components.h"
#include "stuffing/stuffing.h"
#include "stuffing/surface_distance.h"
#include "surface/gradient_normals.h"
#include "surface/marching_cubes.h"
#include "surface/regularize.h"
#include "surface/snapping.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/components.h"
#include "tools/shared/cli.h"
#include "tools/shared/distrust.h"
#include "tools/shared/surface_choice.h"
#include "tools/shared/surface_report.h"
#include "tools/shared/tet_report.h"
#include "volume/crop.h"
#include "volume/resample.h"

#include <algorithm>

using namespace gewebe;

namespace {

struct Arguments {
  std::string volume = "-", place, components;
  std::optional<double> isovalue, voxel, epsilon, cell;
  std::vector<double> box; // x0 y0 z0 x1 y1 z1
  std::int64_t rounds = 0;
  bool tets = false, normals = false, self_intersections = false;
};

/// \throw UsageError for options that don't go together
void check(const Arguments& arguments) {
  component_choice(arguments.components);
  box_of(arguments.box);
  if (!arguments.tets && arguments.cell)
    throw UsageError("--cell is for --tets, expected both (--resample gives a surface's spacing)");
  const auto refuse = [&](bool given, const char* option) {
    if (arguments.tets && given)
      throw UsageError(std::string(option) + " is for surfaces, expected it without --tets");
  };
  refuse(arguments.epsilon.has_value(), "--epsilon");
  refuse(!arguments.place.empty(), "--place");
  refuse(arguments.rounds > 0, "--regularize");
  refuse(arguments.normals, "--normals");
  refuse(arguments.self_intersections, "--self-intersections");
}

/// The kinds of both; those of surfaces first.
std::vector<Kind> writable_kinds() {
  std::vector<Kind> kinds = writable_mesh_kinds();
  for (const Kind kind : writable_tet_kinds())
    if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end())
      kinds.push_back(kind);
  return kinds;
}

void warn_of_components(cli::Run& run, std::uint64_t kept, std::uint64_t dropped) {
  run.say(std::to_string(dropped) + " components dropped, " + std::to_string(kept) + " kept");
  if (kept == 0 && dropped > 0)
    run.warn("no component is as large as --components asks");
}

/// What the options ask for beyond the snapped mesh.
void refine(cli::Run& run, const Arguments& arguments, const Grid& grid, double isovalue,
            TriangleMesh& mesh) {
  const Context& context = run.context();
  cli::Stats& stats = run.stats();
  if (!arguments.components.empty()) {
    const ComponentReport report = keep_components(mesh, component_choice(arguments.components));
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

void compare_topology(cli::Run& run, const char* option, const Topology& before,
                      const Topology& after) {
  run.stats().set("components_before", before.components);
  run.stats().set("euler_before", before.euler);
  if (before == after)
    return;
  cli::distrust(run, "mc-opt",
                std::string(option) + " changes the surface from " +
                    std::to_string(before.components) +
                    (before.components == 1 ? " component" : " components") + " and Euler number " +
                    std::to_string(before.euler) + " to " + std::to_string(after.components) +
                    " and " + std::to_string(after.euler) + ", expected the same of finer " +
                    (option == std::string_view("--cell") ? "cells" : "voxels"));
}

/// The volume as it is meshed, and the topology of its surface as it came where that may change.
struct Prepared {
  Grid grid;
  double isovalue = 0;
  std::optional<Topology> before;
};

Prepared prepare(cli::Run& run, const Arguments& arguments, Input& input) {
  const Context& context = run.context();
  Prepared result;
  result.grid = run.timed("read", [&] { return read_volume(input, context); });
  result.isovalue = arguments.isovalue.value_or(default_isovalue(result.grid.info()));
  at(input.name(), [&] {
    if (arguments.voxel || arguments.cell)
      result.before =
          run.timed("topology", [&] { return topology_of(context, result.grid, arguments); });
    if (arguments.voxel)
      result.grid = run.timed("resample", [&] {
        return resample(context, result.grid, uniform_transform(*arguments.voxel));
      });
    if (!arguments.box.empty())
      result.grid = run.timed("crop", [&] {
        return crop(context, result.grid, box_of(arguments.box), result.isovalue);
      });
  });
  return result;
}

void warn_if_empty(cli::Run& run, bool empty) {
  if (empty)
    cli::distrust(run, "mc-opt",
                  "the surface is empty: no value lies across the isovalue from another");
}

/// What was lost of the volume's own surface, and how far the boundary lies from it.
void compare_surface(cli::Run& run, const Prepared& prepared, const StuffingOptions& options,
                     const TriangleMesh& surface) {
  const Context& context = run.context();
  const double volume =
      signed_volume(marching_cubes(context, prepared.grid, prepared.isovalue).mesh);
  run.stats().set("volume_isosurface", volume);
  const SurfaceDistance distance = surface_distance(context, prepared.grid, options, surface);
  run.stats().set("distance_max", distance.largest);
  run.stats().set("distance_mean", distance.mean);
  run.stats().set("beyond_cell", distance.beyond_cell);
}

void work_solid(cli::Run& run, const Arguments& arguments) {
  const Kind kind = output_kind(run.to(), run.output(), Kind::ply, writable_tet_kinds());
  Output output(run.output(), run.output_options(is_binary(kind)));
  Input input(arguments.volume);
  const Prepared prepared = prepare(run, arguments, input);
  const StuffingOptions options{prepared.isovalue, arguments.cell};
  StuffingReport report;
  TetMesh mesh = at(input.name(), [&] {
    return run.timed("stuff",
                     [&] { return stuff(run.context(), prepared.grid, options, &report); });
  });
  cli::Stats& stats = run.stats();
  stats.set("cell", report.cell);
  stats.set("cut_nodes", report.cut_nodes);
  stats.set("warped_nodes", report.warped);
  stats.set("refused_warps", report.refused_warps);
  stats.set("largest_shift", report.largest_shift);
  run.say(std::to_string(mesh.tetrahedra.size()) + " tetrahedra, " +
          std::to_string(mesh.points.size()) + " points");
  const bool comparable = prepared.before && prepared.before->components > 0;
  warn_if_empty(run, mesh.tetrahedra.empty() && !comparable);
  if (comparable)
    compare_topology(run, arguments.cell ? "--cell" : "--resample", *prepared.before,
                     topology(boundary(mesh).mesh));
  if (!arguments.components.empty()) {
    const TetComponentReport kept = keep_components(mesh, component_choice(arguments.components));
    stats.set("components_dropped", kept.dropped);
    stats.set("tetrahedra_dropped", kept.dropped_tetrahedra);
    stats.set("volume_dropped", kept.dropped_volume);
    stats.set("largest_dropped", kept.largest_dropped);
    warn_of_components(run, kept.kept, kept.dropped);
  }
  run.timed("write",
            [&] { write_tet_mesh(output, mesh, kind, run.output_options(is_binary(kind))); });
  output.commit();
  if (run.stats_wanted())
    run.timed("examine", [&] {
      const TriangleMesh surface = cli::report_tetrahedra(run, mesh);
      if (!mesh.tetrahedra.empty())
        compare_surface(run, prepared, options, surface);
    });
}

void work_surface(cli::Run& run, const Arguments& arguments) {
  const Kind kind = output_kind(run.to(), run.output(), Kind::ply, writable_mesh_kinds());
  Output output(run.output(), run.output_options(is_binary(kind)));
  Input input(arguments.volume);
  const Context& context = run.context();
  const Prepared prepared = prepare(run, arguments, input);
  const IsoSurface surface = at(input.name(), [&] {
    return run.timed("marching_cubes", [&] {
      return marching_cubes_to_snap(context, prepared.grid, arguments.isovalue);
    });
  });
  SnapOptions options;
  options.epsilon = arguments.epsilon.value_or(options.epsilon);
  options.place =
      arguments.place == "corner" ? SnapOptions::Place::corner : SnapOptions::Place::mean;
  SnapResult snapped = run.timed("snap", [&] { return snap(context, surface, options); });
  cli::report_meshing(run.stats(), prepared.grid, surface, snapped.report);
  run.say(std::to_string(snapped.report.points_before) + " points, " +
          std::to_string(snapped.report.points_after) + " after snapping");
  warn_if_empty(run, snapped.mesh.triangles.empty());
  if (!snapped.mesh.triangles.empty() && prepared.before)
    compare_topology(run, "--resample", *prepared.before, topology(snapped.mesh));
  refine(run, arguments, prepared.grid, prepared.isovalue, snapped.mesh);
  run.timed("write", [&] { write_mesh(output, snapped.mesh, kind); });
  output.commit();
  if (run.stats_wanted())
    run.timed("examine", [&] { report_surface(run, snapped.mesh, arguments.self_intersections); });
}

} // namespace

int main(int argc, char** argv) {
  cli::Program program("mc-opt",
                       "Turns a volume into a closed triangle mesh of its isosurface, with "
                       "fewer and better triangles than marching cubes alone; or into "
                       "tetrahedra that fill it.");
  Arguments arguments;
  program.option("--iso", arguments.isovalue, "V",
                 "inside is above V (in a level set: below); default: the volume's own");
  program
      .option("--epsilon", arguments.epsilon, "E",
              "merge points within E voxel edges of a voxel centre (default 0.15)")
      .range(0, 0.5);
  program
      .option("--place", arguments.place, "WHERE",
              "put merged points at their mean (default) or at the voxel centre (corner)")
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
  program.flag("--tets", arguments.tets, "fill the inside with tetrahedra");
  program
      .option("--cell", arguments.cell, "S",
              "with --tets: cells of S mm, each of 12 tetrahedra (default: the voxel)")
      .positive();
  program.output_kinds(writable_kinds());
  program.operand("VOLUME", arguments.volume, "OpenVDB volume");
  program.check([&] { check(arguments); });
  return program.run(argc, argv, [&](cli::Run& run) {
    arguments.tets ? work_solid(run, arguments) : work_surface(run, arguments);
  });
}
