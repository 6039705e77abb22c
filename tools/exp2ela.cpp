// exp2ela: mesh or primitive -> deformable model; model -> model or mesh.

#include "formats/mesh/mesh_file.h"
#include "formats/model/ela.h"
#include "formats/tetrahedra/tet_file.h"
#include "model/build.h"
#include "model/figures.h"
#include "tools/shared/cli.h"
#include "tools/shared/mesh_size.h"
#include "tools/shared/model_arguments.h"
#include "tools/shared/model_fit.h"
#include "tools/shared/net_source.h"
#include "tools/shared/solid_source.h"
#include "tools/shared/space_option.h"
#include "tools/shared/transform_option.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

using namespace gewebe;

namespace {

std::vector<Kind> and_ela(std::vector<Kind> kinds) {
  kinds.push_back(Kind::ela);
  return kinds;
}

std::vector<Kind> all_inputs() {
  std::vector<Kind> kinds = and_ela(readable_mesh_kinds());
  for (const Kind kind : readable_tet_kinds())
    if (std::ranges::find(kinds, kind) == kinds.end())
      kinds.push_back(kind);
  return kinds;
}

void refuse(bool wrong, const char* what) {
  if (wrong)
    throw UsageError(what);
}

void fix(Model& model, const ModelArguments& a) {
  const auto load = [](const std::string& name) { return Input(name, false).read_all(); };
  for (const auto node : select_nodes(model, *a.fixed, load, SelectorScope::body))
    model.nodes[node].fixed |= *fixed_axes_from_name(a.axes);
}

/// \param space  gets the space that the model is in
Model source(cli::Run& run, const ModelArguments& a, Space& space) {
  const std::optional<Affine> map =
      a.transform.empty() ? std::nullopt : std::optional(transform_from_text(a.transform));
  space = space_from_name(a.space);
  if (a.matrix) {
    require_parts(a.build.material, {});
    const double nodes = static_cast<double>(a.matrix->m) * a.matrix->n;
    require_memory(run.context(),
                   nodes * static_cast<double>(sizeof(Vec3) + 2 * sizeof(Triangle)) +
                       (a.solid ? 0 : model_bytes(nodes, 2 * nodes, a.build.bend)),
                   "the primitive");
    TriangleMesh mesh = primitive_mesh(*a.matrix);
    if (map)
      apply(*map, mesh);
    return cli::model_of_surface(run, a.primitive, std::move(mesh), a);
  }
  Input input(a.mesh);
  const Kind from = input_kind(input.peek(4096), a.mesh, run.format());
  // No given option may be ignored.
  refuse(from == Kind::ela && (!a.unit.empty() || a.weld != "auto" || !a.repair.empty() ||
                               a.order != 2 || a.solid || a.build != BuildOptions{}),
         "the input is a model, expected a mesh for options that build one");
  if (from == Kind::ela) {
    Space stated = Space::unknown;
    Model model = run.timed("read", [&] { return read_ela(input, run.context(), &stated); });
    space = result_space(stated, a.space);
    Affine whole;
    if (spaces_differ(stated, space))
      whole.m[0] = whole.m[5] = -1;
    if (map)
      whole = *map * whole;
    if (whole != Affine{})
      at(input.name(), [&] { apply(whole, model); });
    return model;
  }
  const bool tetrahedra = holds_tetrahedra(input.peek(4096), from);
  refuse(a.solid && tetrahedra, "--solid: the input holds tetrahedra already, expected a surface");
  if (tetrahedra)
    return cli::solid_source(run, input, from, a);
  refuse(!a.solid && (a.values.poisson || a.order != 2),
         "the input is a surface, expected --solid beside --poisson and --order");
  const MeshReadOptions options{.kind = from,
                                .unit = a.unit,
                                .weld = weld_from_name(a.weld),
                                .max_memory = run.context().max_memory};
  TriangleMesh mesh = run.timed("read", [&] { return read_mesh(input, options); });
  if (map)
    at(input.name(), [&] { apply(*map, mesh); });
  at(input.name(), [&] { require_parts(a.build.material, mesh.part); });
  if (a.unit.empty())
    cli::warn_of_size(run, input.name(), mesh, {});
  return cli::model_of_surface(run, input.name(), std::move(mesh), a);
}

void hold_step(cli::Run& run, Model& model, const ModelArguments& a) {
  if (!a.dt)
    return;
  if (a.scale_mass)
    run.stats().set("scaled_masses", std::uint64_t{scale_masses(model, *a.dt)});
  require_safe_step(model, *a.dt);
}

void report_steps(cli::Run& run, const Model& model) {
  const std::vector<double> steps = safe_steps(model);
  const auto min = std::min_element(steps.begin(), steps.end());
  run.stats().set("safe_step", *min);
  run.stats().set("safe_step_node", static_cast<std::uint64_t>(min - steps.begin()));
}

void work(cli::Run& run, ModelArguments& a) {
  if (!a.materials.empty())
    choose_materials(a);
  const Kind to = output_kind(run.to(), run.output(), Kind::ela, and_ela(writable_mesh_kinds()));
  Output output(run.output(), run.output_options(is_binary(to)));
  Space space = Space::unknown;
  Model model = source(run, a, space);
  if (!a.name.empty())
    model.name = a.name;
  if (a.fixed)
    fix(model, a);
  if (!a.fit.empty())
    cli::fit_model(run, model, a.fit);
  if (to == Kind::ela)
    cli::warn_of_hinges(run, model);
  hold_step(run, model, a);
  run.timed("write", [&] {
    if (to == Kind::ela)
      write_ela(output, model, run.context(), space);
    else
      write_mesh(output, surface_mesh(model), to);
  });
  output.commit();
  if (!run.stats_wanted())
    return;
  for (const auto& [key, count] : model_counts(model, run.context()))
    run.stats().set(key, count);
  run.stats().set("total_mass", total_mass(model));
  if (model.tetrahedra.empty())
    report_steps(run, model);
  run.stats().set("digest", model_digest(model));
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("exp2ela", "Turns a mesh into a deformable model.");
  ModelArguments a;
  declare(p, a);
  declare_space(p, a.space);
  declare_transform(p, a.transform);
  p.output_kinds(and_ela(writable_mesh_kinds()));
  p.input_kinds(all_inputs());
  p.operand("MESH", a.mesh, "mesh, tetrahedra or model");
  p.check([&] { complete(a); });
  return p.run(argc, argv,
               [&](cli::Run& run) { a.list_materials ? list_materials(run, a) : work(run, a); });
}
