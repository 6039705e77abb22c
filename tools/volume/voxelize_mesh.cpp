#include "tools/volume/voxelize_mesh.h"

#include "formats/mesh/mesh_file.h"
#include "formats/volume/label_volume.h"
#include "formats/volume/volume_file.h"
#include "surface/marching_cubes.h"
#include "text/number_text.h"
#include "tools/cli/distrust.h"
#include "tools/cli/mesh_size.h"
#include "tools/cli/report.h"
#include "tools/cli/space_option.h"
#include "tools/cli/transform_option.h"
#include "tools/volume/topology_change.h"
#include "volume/lattice.h"
#include "voxelization/lost_parts.h"

#include <cmath>

namespace gewebe::cli {

namespace {

/// The lattice; with --like its space too.
volume::GridTransform lattice(const MeshToVoxelize& a, const formats::Input& input,
                              const TriangleMesh& mesh, const Context& context, Space& space) {
  if (a.voxel)
    return volume::uniform_transform(*a.voxel);
  if (a.dim)
    return at(input.name(), [&] { return volume::lattice_for_dim(bounding_box(mesh), *a.dim); });
  formats::Input like(a.like);
  const volume::GridTransform transform =
      formats::read_volume(like, context, &space).info().transform;
  if (!transform.is_cubic())
    throw Error(like.name(), "has " + transform.describe() + ", expected cubic voxels");
  return transform;
}

void report(cli::Run& run, const MeshToVoxelize& a, const antialiasing::CoverageReport& r) {
  cli::Stats& stats = run.stats();
  stats.set("antialias", a.antialias);
  stats.set("triangles", r.mesh.triangles);
  stats.set("triangles_skipped", r.mesh.triangles_skipped);
  stats.set("boundary_edges", r.mesh.boundary_edges);
  stats.set("holes", r.mesh.holes);
  stats.set("odd_rays", r.mesh.odd_rays);
  stats.set("crossings", r.mesh.crossings);
  stats.set("exact_tests", r.mesh.exact_tests);
  stats.set("surface_voxels", r.surface_voxels);
  stats.set("overlap_voxels", r.overlap_voxels);
  stats.set("parts", r.mesh.parts);
  stats.set("parts_turned", r.mesh.parts_turned);
  stats.set("triangles_turned", r.mesh.triangles_turned);
  stats.set("triangles_duplicate", r.mesh.triangles_duplicate);
  stats.set("samples_summed", r.mesh.samples_summed);
}

const char* lattice_option(const MeshToVoxelize& a) {
  return a.voxel ? "--voxel" : a.dim ? "--dim" : "--like";
}

/// Warns where parts of the mesh vanish between the voxels, closed or not. \return whether some do
bool check_parts(cli::Run& run, const MeshToVoxelize& a, const std::string& place,
                 const TriangleMesh& mesh, const volume::Grid& grid) {
  const voxelization::LostParts found = voxelization::find_lost_parts(mesh, grid);
  run.stats().set("parts_lost", found.lost);
  if (found.lost > 0)
    cli::distrust(run, "voxelize",
                  place + ": " + std::to_string(found.lost) + " of " + std::to_string(found.parts) +
                      (found.lost == 1 ? " parts has" : " parts have") +
                      " no voxel, expected a smaller voxel than by " + lattice_option(a));
  return found.lost > 0;
}

/// Warns where walls vanish between the voxels. Whole organs of 16 voxels or more lose nothing by
/// this measure, the edges of a tetrahedron of 30 voxels 0.3 %.
void check_walls(cli::Run& run, const MeshToVoxelize& a, const std::string& place,
                 const TriangleMesh& mesh, const volume::Grid& grid) {
  constexpr double usual = 0.005;
  const double lost = voxelization::lost_surface(mesh, grid);
  run.stats().set("surface_lost", lost);
  if (lost > usual)
    cli::distrust(run, "voxelize",
                  place + ": thin walls break: " + text::number_text(std::round(1000 * lost) / 10) +
                      " % of the surface is two voxels or more away from all voxels inside, "
                      "expected a smaller voxel than by " +
                      lattice_option(a) +
                      (a.options.rule == voxelization::VoxelRule::winding
                           ? ""
                           : ", or --rule winding where the outermost surface is meant"));
}

/// Whether the topology is compared: with more leaves than this that takes too large a part of the
/// run, so that only --stats is worth it.
bool compares_topology(const cli::Run& run, const volume::Grid& grid,
                       const antialiasing::CoverageReport& r) {
  constexpr std::size_t most_leaves = 1000;
  return r.mesh.boundary_edges == 0 && grid.active_voxels() > 0 &&
         (run.stats_wanted() || grid.leaves().size() <= most_leaves);
}

/// Warns where the voxels are too coarse for a closed mesh. \return whether they are
bool check_topology(cli::Run& run, const MeshToVoxelize& a, const std::string& place,
                    const TriangleMesh& mesh, const volume::Grid& grid) {
  const cli::FilledTopology before = cli::filled_topology(mesh);
  mesh::Topology after;
  try {
    after = mesh::topology(surface::marching_cubes(run.context(), grid).mesh);
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) { // memory that the volume itself did not need
    run.say("the topology is not compared: " + std::string(error.what()));
    return false;
  }
  if (before.topology != after && !cli::is_surface_of_volume(run.context(), before, a.options.rule))
    return false;
  cli::compare_topology(run, "voxelize", place, lattice_option(a), before.topology, after,
                        "voxels");
  return before.topology != after;
}

} // namespace

void voxelize_mesh(cli::Run& run, const MeshToVoxelize& a) {
  formats::Output output = open_volume(run);
  formats::Input input(a.name);
  if (formats::is_label_volume(input.peek(4096)))
    throw Error(input.name(), "is a label volume or a scan, expected a mesh, --label L or "
                              "--threshold LOW");
  formats::MeshReadOptions read;
  read.kind = formats::input_kind(input.peek(4096), a.name, run.format());
  read.unit = a.unit;
  read.weld = formats::weld_from_name(a.weld);
  read.max_memory = run.context().max_memory;
  read.drop_unused = true; // so that they don't count for --dim
  TriangleMesh mesh = run.timed("read", [&] { return formats::read_mesh(input, read); });
  if (!a.transform.empty())
    at(input.name(), [&] { apply(transform_from_text(a.transform), mesh); });
  VolumeOutput to = a.output;
  Space of_lattice = to.space;
  const volume::GridTransform transform = lattice(a, input, mesh, run.context(), of_lattice);
  if (spaces_differ(to.space, of_lattice)) {
    for (Vec3& p : mesh.points)
      p = other_space(p);
    run.say(input.name() + ": turned from " + std::string(space_name(to.space)) + " to " +
            std::string(space_name(of_lattice)) + ", the space of --like");
  }
  if (of_lattice != Space::unknown)
    to.space = of_lattice;

  antialiasing::CoverageReport counts;
  const volume::Grid grid = run.timed("voxelize", [&] {
    return antialiased(run, input.name(), mesh, transform, a.choice, a.options, counts);
  });
  if (grid.active_voxels() == 0)
    cli::distrust(run, "voxelize", input.name() + ": no voxel centre lies inside the mesh");
  else if (a.unit.empty())
    cli::warn_of_size(run, input.name(), mesh, std::cbrt(std::fabs(transform.determinant())));
  bool told = false;
  if (grid.active_voxels() > 0)
    told = run.timed("parts", [&] { return check_parts(run, a, input.name(), mesh, grid); });
  if (compares_topology(run, grid, counts))
    told =
        run.timed("topology", [&] { return check_topology(run, a, input.name(), mesh, grid); }) ||
        told;
  // The winding rule alone gives an open mesh walls; by others the warning of holes says more.
  if (grid.active_voxels() > 0 && !told &&
      (counts.mesh.boundary_edges == 0 || a.options.rule == voxelization::VoxelRule::winding))
    run.timed("walls", [&] { check_walls(run, a, input.name(), mesh, grid); });
  write(run, output, grid, to);
  report(run, a, counts);
  cli::report_volume(run, grid);
}

} // namespace gewebe::cli
