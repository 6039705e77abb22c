// exp2ela: mesh -> deformable model; model -> model or mesh.

#include "formats/ela.h"
#include "formats/mesh_file.h"
#include "model/build.h"
#include "model/check.h"
#include "model/figures.h"
#include "model/selector.h"
#include "tools/cli.h"

using namespace gewebe;
namespace {

struct Arguments {
  std::string mesh = "-", unit, weld = "auto", material = "generic", name, fix = "none",
              axes = "xyz";
  MaterialOverrides values;
  BuildOptions build;
  std::optional<Selector> fixed;
};

std::vector<Kind> and_ela(std::vector<Kind> kinds) {
  kinds.push_back(Kind::ela);
  return kinds;
}

/// What the library finds wrong with an option's text is wrong use.
template <class Work>
auto parsed(const char* option, Work&& parse) {
  try {
    return parse();
  } catch (const Error& error) {
    throw UsageError(std::string(option) + ": " + error.what());
  }
}

void refuse(bool wrong, const char* what) {
  if (wrong)
    throw UsageError(what);
}

void complete(Arguments& a) {
  refuse(a.build.stiffness && a.values.young, "--stiffness and --young, expected one of them");
  refuse(a.build.mass && a.values.density, "--mass and --density, expected one of them");
  refuse(!a.build.bend && a.build.bend_factor != BuildOptions{}.bend_factor,
         "--bend-stiffness without --bend, expected both");
  refuse(a.fix == "none" && a.axes != Arguments{}.axes, "--fix-axes without --fix, expected both");
  parsed("--name", [&] { check_name(a.name); });
  a.build.material = parsed("--material", [&] { return parse_material_choice(a.material); });
  override_materials(a.build.material.materials, a.values);
  if (a.fix == "none")
    return;
  a.fixed = parsed("--fix", [&] { return parse_selector(a.fix); });
  std::vector<std::string> inputs = node_list_names(*a.fixed);
  inputs.push_back(a.mesh);
  cli::check_one_pipe(inputs);
}

Model from_mesh(cli::Run& run, Input& input, Kind kind, const Arguments& a) {
  const MeshReadOptions options{kind, a.unit, weld_from_name(a.weld)};
  const TriangleMesh mesh = run.timed("read", [&] { return read_mesh(input, options); });
  BuiltModel built = run.timed("build", [&] {
    return at(input.name(), [&] { return build_model(mesh, a.build, run.context()); });
  });
  for (const BuildReport::Line& line : built.report.lines()) {
    run.stats().set(line.key, std::uint64_t{line.count});
    if (line.count > 0 && line.warning != nullptr)
      run.warn(input.name() + ": " + std::to_string(line.count) + " " + line.warning);
  }
  return std::move(built.model);
}

void fix(Model& model, const Arguments& a) {
  const auto load = [](const std::string& name) { return Input(name, false).read_all(); };
  for (const auto node : select_nodes(model, *a.fixed, load))
    model.nodes[node].fixed |= *fixed_axes_from_name(a.axes);
}

void work(cli::Run& run, const Arguments& a) {
  const Kind to = output_kind(run.to(), run.output(), Kind::ela, and_ela(writable_mesh_kinds()));
  Output output(run.output(), run.output_options(is_binary(to)));
  Input input(a.mesh);
  const Kind from = input_kind(input.peek(4096), a.mesh, run.format());
  // Nothing that was asked for may be ignored.
  refuse(from == Kind::ela && (!a.unit.empty() || a.weld != "auto" || a.build != BuildOptions{}),
         "the input is a model, expected a mesh for options that build one");
  Model model = from == Kind::ela
                    ? run.timed("read", [&] { return read_ela(input, run.context()); })
                    : from_mesh(run, input, from, a);
  if (!a.name.empty())
    model.name = a.name;
  if (a.fixed)
    fix(model, a);
  run.timed("write", [&] {
    if (to == Kind::ela)
      write_ela(output, model, run.context());
    else
      write_mesh(output, surface_mesh(model), to);
  });
  output.commit();
  if (!run.stats_wanted())
    return;
  for (const auto& [key, count] : model_counts(model, run.context()))
    run.stats().set(key, count);
  run.stats().set("total_mass", total_mass(model));
  run.stats().set("safe_step", safe_step(model));
  run.stats().set("digest", model_digest(model));
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("exp2ela", "Turns a mesh into a model of masses and springs.");
  Arguments a;
  BuildOptions& b = a.build;
  p.option("--fix", a.fix, "SELECTOR", "nodes that can't move, or none");
  p.option("--fix-axes", a.axes, "AXES", "axes along which they can't move")
      .one_of({"x", "y", "z", "xy", "xz", "yz", "xyz"});
  p.option("--centrals", b.centrals, "K", "central nodes per component").range(0, 1000);
  p.option("--central-stiffness", b.central_factor, "F",
           "their springs' stiffness over edge springs'")
      .range(0, 1e9);
  p.flag("--centrals-free", b.centrals_free, "central nodes can move");
  p.flag("--bend", b.bend, "add bending springs across edges");
  p.option("--bend-stiffness", b.bend_factor, "F", "their stiffness over that of the edge")
      .range(0, 1e9);
  p.option("--material", a.material, "NAME",
           "generic, liver, gallbladder, uterus; PART=NAME for a part");
  p.option("--density", a.values.density, "D", "g/mm3, instead of the material's").positive();
  p.option("--young", a.values.young, "E", "Young's modulus in Pa, instead of the material's")
      .positive();
  p.option("--thickness", a.values.thickness, "H", "of the wall in mm, instead of the material's")
      .positive();
  p.option("--damping-ratio", a.values.damping_ratio, "Z", "of a spring, instead of the material's")
      .range(0, 1e6);
  p.option("--stiffness", b.stiffness, "K", "of every edge spring in g/s2").positive();
  p.option("--mass", b.mass, "M", "of every surface node in g").positive();
  p.option("--drag", b.drag_rate, "RATE", "drag of a node per mass in 1/s").range(0, 1e9);
  p.flag("--normals", b.normals, "add vertex normals");
  p.option("--name", a.name, "NAME", "name of the model, else that of its first material");
  p.option("--unit", a.unit, "UNIT", "unit of the mesh: m, cm, mm").one_of(mesh_unit_names());
  p.option("--weld", a.weld, "MODE", "points that become one: auto, all, part, none")
      .one_of(weld_names());
  p.output_kinds(and_ela(writable_mesh_kinds()));
  p.input_kinds(and_ela(readable_mesh_kinds()));
  p.operand("MESH", a.mesh, "the mesh, or a model");
  p.check([&] { complete(a); });
  return p.run(argc, argv, [&](cli::Run& run) { work(run, a); });
}
