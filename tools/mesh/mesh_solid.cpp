#include "base/error.h"
#include "formats/tetrahedra/tet_file.h"
#include "formats/volume/label_volume.h"
#include "formats/volume/volume_file.h"
#include "stuffing/materials.h"
#include "stuffing/stuffing.h"
#include "stuffing/surface_distance.h"
#include "surface/marching_cubes.h"
#include "tetrahedra/boundary.h"
#include "tetrahedra/components.h"
#include "tools/mesh/mesh_work.h"
#include "tools/mesh/prepared_volume.h"
#include "tools/shared/surface_choice.h"
#include "tools/shared/tet_report.h"
#include "tools/shared/voxelize_labels.h"

#include <cstdint>
#include <string>
#include <vector>

namespace gewebe {
namespace {

/// What was lost of the volume's own surface, and how far the boundary lies from it.
void compare_surface(cli::Run& run, const PreparedVolume& prepared, const StuffingOptions& options,
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

/// With --label: how many voxels away from a tetrahedron its label may be. The smooth surface of
/// labels lies within a voxel of them, a coarse cell's edge some more.
constexpr std::int32_t label_reach = 3;

/// The volumes of --materials, opened before the work: one of labels, or any number of others.
struct MaterialVolumes {
  explicit MaterialVolumes(const MeshArguments& arguments) {
    const std::vector<std::string> paths = material_paths(arguments);
    for (const std::string& path : paths) {
      Input& input = inputs.emplace_back(path);
      labels = is_label_volume(input.peek(4096));
      if (labels && paths.size() > 1)
        throw Error(input.name(), "is a label volume, expected it alone in --materials");
      if (!labels && !arguments.labels.empty())
        throw Error(input.name(), "is no label volume, expected one for --label");
    }
    if (!arguments.labels.empty())
      wanted = labels_from_text(arguments.labels, "whole numbers");
  }
  std::vector<Input> inputs;
  bool labels = false;
  std::vector<LabelRange> wanted; ///< of the labels; empty: all
};

void set_materials(cli::Run& run, MaterialVolumes& volumes, TetMesh& mesh) {
  const Context& context = run.context();
  std::int32_t number = 0;
  for (Input& input : volumes.inputs) {
    if (volumes.labels) {
      const AllLabels labels = read_all_labels(input, volumes.wanted, context);
      for (const std::string& warning : labels.warnings)
        run.warn(warning);
      at(input.name(), [&] {
        set_materials(context, labels.voxels, mesh, volumes.wanted.empty() ? 0 : label_reach);
      });
    } else {
      const Grid volume = read_volume(input, context);
      at(input.name(), [&] { set_material(context, volume, ++number, mesh); });
    }
  }
}

} // namespace

void mesh_solid(cli::Run& run, const MeshArguments& arguments) {
  const Kind kind = output_kind(run.to(), run.output(), Kind::ply, writable_tet_kinds());
  Output output(run.output(), run.output_options(is_binary(kind)));
  Input input(arguments.volume);
  MaterialVolumes materials(arguments);
  const PreparedVolume prepared = prepare(run, arguments, input);
  const StuffingOptions options{prepared.isovalue, arguments.cell,
                                static_cast<unsigned>(arguments.grade)};
  StuffingReport report;
  TetMesh mesh = at(input.name(), [&] {
    return run.timed("stuff",
                     [&] { return stuff(run.context(), prepared.grid, options, &report); });
  });
  if (!materials.inputs.empty())
    run.timed("materials", [&] { set_materials(run, materials, mesh); });
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

} // namespace gewebe
