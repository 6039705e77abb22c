// exp2ela: mesh or primitive -> deformable model; model -> model or mesh.

#include "formats/mesh/mesh_file.h"
#include "formats/model/ela.h"
#include "model/figures.h"
#include "model/hinge.h"
#include "tools/shared/cli.h"
#include "tools/shared/mesh_size.h"
#include "tools/shared/model_arguments.h"

#include <algorithm>
#include <string>
#include <vector>

using namespace gewebe;

namespace {

std::vector<Kind> and_ela(std::vector<Kind> kinds) {
  kinds.push_back(Kind::ela);
  return kinds;
}

void refuse(bool wrong, const char* what) {
  if (wrong)
    throw UsageError(what);
}

void repair(cli::Run& run, const std::string& name, TriangleMesh& mesh, const ModelArguments& a) {
  const RepairReport report = run.timed("repair", [&] {
    return at(name, [&] { return repair_mesh(mesh, a.repairs, run.context()); });
  });
  for (const RepairReport::Line& line : report.lines()) {
    run.stats().set(line.key, line.count);
    if (line.count == 0)
      continue;
    const std::string text = name + ": " + std::to_string(line.count) + " " + line.text;
    line.trouble ? run.warn(text) : run.say(text);
  }
}

Model from_mesh(cli::Run& run, const std::string& name, TriangleMesh mesh,
                const ModelArguments& a) {
  if (!a.repair.empty())
    repair(run, name, mesh, a);
  BuiltModel built = run.timed(
      "build", [&] { return at(name, [&] { return build_model(mesh, a.build, run.context()); }); });
  for (const BuildReport::Line& line : built.report.lines()) {
    run.stats().set(line.key, std::uint64_t{line.count});
    if (line.count > 0 && line.warning != nullptr)
      run.warn(name + ": " + std::to_string(line.count) + " " + line.warning);
  }
  return std::move(built.model);
}

void fix(Model& model, const ModelArguments& a) {
  const auto load = [](const std::string& name) { return Input(name, false).read_all(); };
  for (const auto node : select_nodes(model, *a.fixed, load))
    model.nodes[node].fixed |= *fixed_axes_from_name(a.axes);
}

/// Few central nodes hold a part of few nodes.
void warn_of_hinges(cli::Run& run, const Model& model) {
  const std::vector<Hinged> hinged = hinged_components(model);
  run.stats().set("hinged_components", std::uint64_t{hinged.size()});
  if (hinged.empty())
    return;
  const Hinged& first = hinged.front();
  run.warn(model.name + ": component " + std::to_string(first.component) + " of " +
           std::to_string(first.nodes) + " nodes" +
           (hinged.size() == 1 ? "" : " and " + std::to_string(hinged.size() - 1) + " more") +
           " can turn about what holds it (" + std::to_string(first.held) +
           (first.held == 1 ? " node" : " nodes on one line") +
           "), expected three places or more: mc-opt --components largest leaves small parts "
           "out, --centrals sets the number");
}

/// \param to_mesh whether the surface alone is wanted
Model source(cli::Run& run, const ModelArguments& a, bool to_mesh) {
  if (a.matrix)
    return from_mesh(run, a.primitive, primitive_mesh(*a.matrix), a);
  Input input(a.mesh);
  const Kind from = input_kind(input.peek(4096), a.mesh, run.format());
  // Nothing that was asked for may be ignored.
  refuse(from == Kind::ela && (!a.unit.empty() || a.weld != "auto" || !a.repair.empty() ||
                               a.build != BuildOptions{}),
         "the input is a model, expected a mesh for options that build one");
  if (from == Kind::ela)
    return run.timed("read", [&] {
      return to_mesh ? read_spring_model(input, run.context()) : read_ela(input, run.context());
    });
  const MeshReadOptions options{from, a.unit, weld_from_name(a.weld)};
  TriangleMesh mesh = run.timed("read", [&] { return read_mesh(input, options); });
  if (a.unit.empty())
    cli::warn_of_size(run, input.name(), mesh, {});
  return from_mesh(run, input.name(), std::move(mesh), a);
}

void hold_step(cli::Run& run, Model& model, const ModelArguments& a) {
  if (!a.dt)
    return;
  if (a.scale_mass)
    run.stats().set("scaled_masses", std::uint64_t{scale_masses(model, *a.dt)});
  require_safe_step(model, *a.dt);
}

void work(cli::Run& run, ModelArguments& a) {
  if (!a.materials.empty())
    choose_materials(a);
  const Kind to = output_kind(run.to(), run.output(), Kind::ela, and_ela(writable_mesh_kinds()));
  Output output(run.output(), run.output_options(is_binary(to)));
  Model model = source(run, a, to != Kind::ela);
  if (!a.name.empty())
    model.name = a.name;
  if (a.fixed)
    fix(model, a);
  if (to == Kind::ela)
    warn_of_hinges(run, model);
  hold_step(run, model, a);
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
  const std::vector<double> steps = safe_steps(model);
  const auto min = std::min_element(steps.begin(), steps.end());
  run.stats().set("safe_step", *min);
  run.stats().set("safe_step_node", static_cast<std::uint64_t>(min - steps.begin()));
  run.stats().set("digest", model_digest(model));
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("exp2ela", "Turns a mesh into a model of masses and springs.");
  ModelArguments a;
  declare(p, a);
  p.output_kinds(and_ela(writable_mesh_kinds()));
  p.input_kinds(and_ela(readable_mesh_kinds()));
  p.operand("MESH", a.mesh, "the mesh, or a model");
  p.check([&] { complete(a); });
  return p.run(argc, argv,
               [&](cli::Run& run) { a.list_materials ? list_materials(run, a) : work(run, a); });
}
