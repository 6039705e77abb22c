// voxelize: closed mesh, labels, scan or contours -> volume.

#include "formats/mesh/mesh_file.h"
#include "tools/cli/cli.h"
#include "tools/cli/filling_rule.h"
#include "tools/cli/space_option.h"
#include "tools/cli/transform_option.h"
#include "tools/volume/voxelize_contours.h"
#include "tools/volume/voxelize_labels.h"
#include "tools/volume/voxelize_mesh.h"
#include "tools/volume/voxelize_scan.h"

using namespace gewebe;

namespace {

struct Arguments {
  cli::MeshToVoxelize mesh;
  std::string on_open = "error", rule = "parity", labels, threshold, space;
  bool contours = false;
};

/// What says how a mesh is read and filled.
void refuse_mesh_options(const cli::Program& p, const std::string& asked) {
  for (const std::string name :
       {"--rule", "--antialias", "--on-open", "--unit", "--weld", "--format", "--transform"})
    if (p.given(name) && !(name == "--unit" && asked == "--contours"))
      throw UsageError(asked + ": " + name + " is for meshes, expected no " + name);
}

void complete(const cli::Program& p, Arguments& a) {
  const bool own_lattice = a.mesh.dim || !a.mesh.like.empty();
  if (int{!a.threshold.empty()} + int{!a.labels.empty()} + int{a.contours} > 1 && a.contours)
    throw UsageError("--contours: the input is either contours, labels or a scan, expected one");
  if (!a.threshold.empty()) {
    cli::check_thresholds(a.threshold, !a.labels.empty(), own_lattice);
    return refuse_mesh_options(p, "--threshold");
  }
  if (!a.labels.empty()) {
    cli::check_labels(a.labels, a.mesh.voxel.has_value(), own_lattice);
    return refuse_mesh_options(p, "--label");
  }
  if (a.contours) {
    if (!a.mesh.voxel || own_lattice)
      throw UsageError("--contours: expected --voxel S, the edge of the voxels in mm");
    return refuse_mesh_options(p, "--contours");
  }
  if (int{a.mesh.voxel.has_value()} + int{a.mesh.dim.has_value()} + int{!a.mesh.like.empty()} != 1)
    throw UsageError("expected exactly one of --voxel, --dim and --like");
  cli::check_one_pipe({a.mesh.name, a.mesh.like});
  a.mesh.options.rule = cli::voxel_rule_from_text(a.rule);
  a.mesh.choice = cli::antialias_from_text(a.mesh.antialias);
  if (a.mesh.options.rule != voxelization::VoxelRule::parity &&
      (a.mesh.choice.filter == cli::Antialias::exact ||
       a.mesh.choice.filter == cli::Antialias::lines))
    throw UsageError("--antialias " + a.mesh.antialias +
                     " goes with --rule parity, not with --rule " + a.rule);
  a.mesh.options.on_open = cli::open_mesh_from_text(a.on_open);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("voxelize",
                 "Turns a closed mesh, exactly, labels, a scan or contours into a volume.");
  Arguments a;
  p.option("--voxel", a.mesh.voxel, "S", "edge of a voxel in mm, centres at multiples of S")
      .positive();
  p.option("--dim", a.mesh.dim, "N", "number of voxels along the longest side of the mesh's box")
      .range(1, 1 << 30);
  p.option("--like", a.mesh.like, "VDB", "take the lattice of this volume");
  p.option("--label", a.labels, "L[-M][,L...]",
           "the input is a label volume (NIfTI, NRRD, MetaImage, INR): convert these labels; list: "
           "print all")
      .such_as({"list"});
  p.option("--threshold", a.threshold, "LOW[,HIGH]",
           "the input is a scan (same formats): convert grey values above LOW and below HIGH");
  p.flag("--contours", a.contours,
         "the input are closed contours in parallel slices, as text: x y z, blank lines between");
  p.option("--rule", a.rule, "RULE", "when a point is inside: parity, winding, zbuffer")
      .one_of({"parity", "winding", "zbuffer"});
  p.option("--antialias", a.mesh.antialias, "FILTER",
           "grey values: jones (for surfaces), exact (for volumes), sramek, lines:N, box:N, none")
      .such_as({"jones", "exact", "sramek", "lines:", "box:", "none"});
  p.option("--on-open", a.on_open, "WHAT",
           "open meshes: error, warn (odd rays stay empty), fill (close the holes)")
      .one_of({"error", "warn", "fill"});
  p.option("--unit", a.mesh.unit, "UNIT", "unit of the mesh: m, cm, mm")
      .one_of(formats::mesh_unit_names());
  p.option("--weld", a.mesh.weld, "MODE", "points at one place to merge: auto, all, part, none")
      .one_of(formats::weld_names());
  cli::declare_space(p, a.space);
  cli::declare_transform(p, a.mesh.transform);
  cli::declare(p, a.mesh.output);
  p.input_kinds(formats::readable_mesh_kinds());
  p.operand("MESH", a.mesh.name, "the mesh");
  p.check([&] { complete(p, a); });
  return p.run(argc, argv, [&](cli::Run& run) {
    a.mesh.output.space = space_from_name(a.space);
    if (!a.threshold.empty())
      cli::voxelize_scan(run, a.mesh.name, cli::thresholds_from_text(a.threshold), a.mesh.voxel,
                         a.mesh.output);
    else if (a.contours)
      cli::voxelize_contours(run, a.mesh.name, a.mesh.unit, *a.mesh.voxel, a.mesh.output);
    else if (a.labels.empty())
      cli::voxelize_mesh(run, a.mesh);
    else if (a.labels == "list")
      cli::list_labels(run, a.mesh.name, a.mesh.output);
    else
      cli::voxelize_labels(run, a.mesh.name, cli::labels_from_text(a.labels), a.mesh.voxel,
                           a.mesh.output);
  });
}
