// voxelize: closed mesh, labels or scan -> volume.

#include "voxelize/voxelize.h"
#include "formats/mesh/mesh_file.h"
#include "formats/volume/label_volume.h"
#include "formats/volume/volume_file.h"
#include "tools/shared/antialias.h"
#include "tools/shared/cli.h"
#include "tools/shared/distrust.h"
#include "tools/shared/mesh_size.h"
#include "tools/shared/report.h"
#include "tools/shared/voxelize_labels.h"
#include "tools/shared/voxelize_scan.h"
#include "volume/lattice.h"

#include <cmath>

using namespace gewebe;

namespace {

struct Arguments {
  std::string mesh = "-", like, unit, weld = "auto", antialias = "jones", on_open = "error";
  std::string rule = "parity";
  std::optional<double> voxel;
  std::optional<std::int64_t> dim;
  AntialiasChoice choice;
  std::string labels, threshold;
  VoxelizeOptions options;
};

VoxelRule rule_from_text(const std::string& text) {
  return text == "winding"   ? VoxelRule::winding
         : text == "zbuffer" ? VoxelRule::zbuffer
                             : VoxelRule::parity;
}

/// What says how a mesh is read and filled.
void refuse_mesh_options(const cli::Program& p, const std::string& asked) {
  for (const std::string name :
       {"--rule", "--antialias", "--on-open", "--unit", "--weld", "--format"})
    if (p.given(name))
      throw UsageError(asked + ": " + name + " is for meshes, expected no " + name);
}

void complete(const cli::Program& p, Arguments& a) {
  const bool own_lattice = a.dim || !a.like.empty();
  if (!a.threshold.empty()) {
    check_thresholds(a.threshold, !a.labels.empty(), own_lattice);
    return refuse_mesh_options(p, "--threshold");
  }
  if (!a.labels.empty()) {
    check_labels(a.labels, a.voxel.has_value(), own_lattice);
    return refuse_mesh_options(p, "--label");
  }
  if (int{a.voxel.has_value()} + int{a.dim.has_value()} + int{!a.like.empty()} != 1)
    throw UsageError("expected exactly one of --voxel, --dim and --like");
  cli::check_one_pipe({a.mesh, a.like});
  a.options.rule = rule_from_text(a.rule);
  a.choice = antialias_from_text(a.antialias);
  if (a.options.rule != VoxelRule::parity &&
      (a.choice.filter == Antialias::exact || a.choice.filter == Antialias::lines))
    throw UsageError("--antialias " + a.antialias + " goes with --rule parity, not with --rule " +
                     a.rule);
  a.options.on_open = a.on_open == "error"  ? OpenMesh::refuse
                      : a.on_open == "warn" ? OpenMesh::skip
                                            : OpenMesh::fill;
}

GridTransform lattice(const Arguments& a, const Input& input, const TriangleMesh& mesh,
                      const Context& context) {
  if (a.voxel)
    return uniform_transform(*a.voxel);
  if (a.dim)
    return at(input.name(), [&] { return lattice_for_dim(bounding_box(mesh), *a.dim); });
  Input like(a.like);
  const GridTransform transform = read_volume(like, context).info().transform;
  if (!transform.is_cubic())
    throw Error(like.name(), "has " + transform.describe() + ", expected cubic voxels");
  return transform;
}

void report(cli::Run& run, const Arguments& a, const CoverageReport& r) {
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

void work(cli::Run& run, const Arguments& a) {
  (void)output_kind(run.to(), run.output(), Kind::vdb, {Kind::vdb});
  Output output(run.output(), run.output_options(true));
  Input input(a.mesh);
  if (is_label_volume(input.peek(4096)))
    throw Error(input.name(), "is a label volume or a scan, expected a mesh, --label L or "
                              "--threshold LOW");
  MeshReadOptions read;
  read.kind = input_kind(input.peek(4096), a.mesh, run.format());
  read.unit = a.unit;
  read.weld = weld_from_name(a.weld);
  read.drop_unused = true; // so that they don't count for --dim
  const TriangleMesh mesh = run.timed("read", [&] { return read_mesh(input, read); });
  const GridTransform transform = lattice(a, input, mesh, run.context());

  CoverageReport counts;
  const Grid grid = run.timed("voxelize", [&] {
    return antialiased(run, input.name(), mesh, transform, a.choice, a.options, counts);
  });
  if (grid.active_voxels() == 0)
    cli::distrust(run, "voxelize", input.name() + ": no voxel centre lies inside the mesh");
  else if (a.unit.empty())
    cli::warn_of_size(run, input.name(), mesh, std::cbrt(std::fabs(transform.determinant())));
  run.timed("write", [&] { write_volume(output, grid, run.context()); });
  output.commit();
  report(run, a, counts);
  cli::report_volume(run, grid);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("voxelize", "Turns a closed mesh, exactly, labels or a scan into a volume.");
  Arguments a;
  p.option("--voxel", a.voxel, "S", "edge of a voxel in mm, centres at multiples of S").positive();
  p.option("--dim", a.dim, "N", "voxels along the longest side of the mesh's box")
      .range(1, 1 << 30);
  p.option("--like", a.like, "VDB", "take the lattice of this volume");
  p.option(
       "--label", a.labels, "L[-M][,L...]",
       "the operand is a label volume (NIfTI, NRRD, MetaImage, INR): these labels together; list: "
       "which there are")
      .such_as({"list"});
  p.option("--threshold", a.threshold, "LOW[,HIGH]",
           "the operand is a scan (the same formats): its grey values above LOW and below HIGH");
  p.option("--rule", a.rule, "RULE", "when a point is inside: parity, winding, zbuffer")
      .one_of({"parity", "winding", "zbuffer"});
  p.option("--antialias", a.antialias, "FILTER",
           "grey values: jones (for surfaces), exact (for volumes), sramek, lines:N, box:N, none")
      .such_as({"jones", "exact", "sramek", "lines:", "box:", "none"});
  p.option("--on-open", a.on_open, "WHAT",
           "an open mesh: error, warn (odd rays stay empty), fill (close the holes)")
      .one_of({"error", "warn", "fill"});
  p.option("--unit", a.unit, "UNIT", "unit of the mesh: m, cm, mm").one_of(mesh_unit_names());
  p.option("--weld", a.weld, "MODE", "points that become one: auto, all, part, none")
      .one_of(weld_names());
  p.output_kinds({Kind::vdb});
  p.input_kinds(readable_mesh_kinds());
  p.operand("MESH", a.mesh, "the mesh");
  p.check([&] { complete(p, a); });
  return p.run(argc, argv, [&](cli::Run& run) {
    if (!a.threshold.empty())
      voxelize_scan(run, a.mesh, thresholds_from_text(a.threshold), a.voxel);
    else if (a.labels.empty())
      work(run, a);
    else if (a.labels == "list")
      list_labels(run, a.mesh);
    else
      voxelize_labels(run, a.mesh, labels_from_text(a.labels), a.voxel);
  });
}
