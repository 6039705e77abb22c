// voxelize: closed mesh or labels -> volume.

#include "volume/voxelize.h"
#include "formats/label_volume.h"
#include "formats/mesh_file.h"
#include "formats/volume_file.h"
#include "tools/cli.h"
#include "tools/report.h"
#include "tools/voxelize_labels.h"
#include "volume/lattice.h"

#include <charconv>

using namespace gewebe;

namespace {

struct Arguments {
  std::string mesh = "-", like, unit, weld = "auto", antialias = "none", on_open = "error";
  std::string rule = "parity";
  std::optional<double> voxel;
  std::optional<std::int64_t> dim;
  std::vector<double> labels;
  VoxelizeOptions options;
};

/// "none", "box:N" or "box=N" with N from 1 to 64.
int samples_from_text(const std::string& text) {
  if (text == "none")
    return 1;
  int n = 0;
  const char* const end = text.data() + text.size();
  if (text.starts_with("box:") || text.starts_with("box="))
    if (const auto [rest, error] = std::from_chars(text.data() + 4, end, n);
        error == std::errc() && rest == end && n >= 1 && n <= 64)
      return n;
  throw UsageError("--antialias: '" + text + "' is unknown, expected none or box:N with N 1 to 64");
}

VoxelRule rule_from_text(const std::string&) {
  return VoxelRule::parity;
}

void complete(Arguments& a) {
  if (!a.labels.empty()) {
    (void)labels_from_numbers(a.labels);
    if (a.dim || !a.like.empty())
      throw UsageError("--label: the labels give the lattice, expected --voxel or nothing");
    return;
  }
  if (int{a.voxel.has_value()} + int{a.dim.has_value()} + int{!a.like.empty()} != 1)
    throw UsageError("expected exactly one of --voxel, --dim and --like");
  cli::check_one_pipe({a.mesh, a.like});
  a.options.rule = rule_from_text(a.rule);
  a.options.samples = samples_from_text(a.antialias);
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

void report(cli::Run& run, const VoxelizeReport& r) {
  cli::Stats& stats = run.stats();
  stats.set("triangles", r.triangles);
  stats.set("triangles_skipped", r.triangles_skipped);
  stats.set("boundary_edges", r.boundary_edges);
  stats.set("holes", r.holes);
  stats.set("odd_rays", r.odd_rays);
  stats.set("crossings", r.crossings);
  stats.set("exact_tests", r.exact_tests);
}

void work(cli::Run& run, const Arguments& a) {
  (void)output_kind(run.to(), run.output(), Kind::vdb, {Kind::vdb});
  Output output(run.output(), run.output_options(true));
  Input input(a.mesh);
  if (is_label_volume(input.peek(4096)))
    throw Error(input.name(), "is a label volume, expected a mesh or --label L");
  MeshReadOptions read;
  read.kind = input_kind(input.peek(4096), a.mesh, run.format());
  read.unit = a.unit;
  read.weld = weld_from_name(a.weld);
  read.drop_unused = true; // so that they don't count for --dim
  const TriangleMesh mesh = run.timed("read", [&] { return read_mesh(input, read); });
  const GridTransform transform = lattice(a, input, mesh, run.context());

  VoxelizeReport counts;
  const InsideScan scan = run.timed("scan", [&] {
    return at(input.name(),
              [&] { return scan_inside(run.context(), mesh, transform, a.options, &counts); });
  });
  if (counts.boundary_edges > 0)
    run.warn(
        input.name() + ": the mesh is open: " + std::to_string(counts.boundary_edges) +
        " boundary edges, " +
        (a.options.on_open == OpenMesh::fill
             ? std::to_string(counts.holes) + (counts.holes == 1 ? " hole closed" : " holes closed")
             : std::to_string(counts.odd_rays) + " odd rays left empty"));
  const Grid grid =
      run.timed("grid", [&] { return grid_from_scan(run.context(), scan, transform); });
  if (scan.origins.empty() && scan.tiles.empty())
    run.warn(input.name() + ": no voxel centre lies inside the mesh");
  run.timed("write", [&] { write_volume(output, grid, run.context()); });
  output.commit();
  report(run, counts);
  cli::report_volume(run, grid);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("voxelize", "Turns a closed mesh, exactly, or labels into a volume.");
  Arguments a;
  p.option("--voxel", a.voxel, "S", "edge of a voxel in mm, centres at multiples of S").positive();
  p.option("--dim", a.dim, "N", "voxels along the longest side of the mesh's box")
      .range(1, 1 << 30);
  p.option("--like", a.like, "VDB", "take the lattice of this volume");
  p.option("--label", a.labels, "L[,L...]",
           "the operand is a label volume (NIfTI, NRRD, MetaImage): these labels");
  p.option("--rule", a.rule, "RULE", "when a point is inside: parity").one_of({"parity"});
  p.option("--antialias", a.antialias, "FILTER", "none: 0 or 1; box:N: mean of N^3 samples");
  p.option("--on-open", a.on_open, "WHAT",
           "an open mesh: error, warn (odd rays stay empty), fill (close the holes)")
      .one_of({"error", "warn", "fill"});
  p.option("--unit", a.unit, "UNIT", "unit of the mesh: m, cm, mm").one_of(mesh_unit_names());
  p.option("--weld", a.weld, "MODE", "points that become one: auto, all, part, none")
      .one_of(weld_names());
  p.output_kinds({Kind::vdb});
  p.input_kinds(readable_mesh_kinds());
  p.operand("MESH", a.mesh, "the mesh");
  p.check([&] { complete(a); });
  return p.run(argc, argv, [&](cli::Run& run) {
    if (a.labels.empty())
      work(run, a);
    else
      voxelize_labels(run, a.mesh, labels_from_numbers(a.labels), a.voxel);
  });
}
