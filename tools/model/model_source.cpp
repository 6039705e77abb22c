#include "tools/model/model_source.h"

#include "formats/mesh/mesh_file.h"
#include "formats/model/ela.h"
#include "formats/stream/stream.h"
#include "formats/tetrahedra/tet_file.h"
#include "model/build.h"
#include "model/figures.h"
#include "model/law_stability.h"
#include "tools/cli/mesh_size.h"
#include "tools/cli/transform_option.h"
#include "tools/model/net_source.h"
#include "tools/model/solid_source.h"

#include <optional>
#include <string>
#include <utility>

namespace gewebe::cli {

namespace {

void refuse(bool wrong, const char* what) {
  if (wrong)
    throw UsageError(what);
}

} // namespace

model::Model model_source(Run& run, ModelArguments a, Space& space) {
  const std::optional<Affine> map =
      a.transform.empty() ? std::nullopt : std::optional(transform_from_text(a.transform));
  space = space_from_name(a.space);
  constexpr const char* for_solids =
      "the input is a surface, expected --solid beside --poisson, --law, --prony and --order";
  if (a.matrix) {
    refuse(!a.solid && (a.values.law || a.values.prony), for_solids);
    number_parts(a.build.material, {});
    require_parts(a.build.material, {});
    const double nodes = static_cast<double>(a.matrix->m) * a.matrix->n;
    require_memory(run.context(),
                   nodes * static_cast<double>(sizeof(Vec3) + 2 * sizeof(Triangle)) +
                       (a.solid ? 0 : model::model_bytes(nodes, 2 * nodes, a.build.bend)),
                   "the primitive");
    TriangleMesh mesh = primitive_mesh(*a.matrix);
    if (map)
      apply(*map, mesh);
    return model_of_surface(run, a.primitive, std::move(mesh), a);
  }
  formats::Input input(a.mesh);
  const formats::Kind from = formats::input_kind(input.peek(4096), a.mesh, run.format());
  // No given option may be ignored.
  refuse(from == formats::Kind::ela &&
             (!a.unit.empty() || a.weld != "auto" || !a.repair.empty() || a.order != 2 || a.solid ||
              a.build != model::BuildOptions{}),
         "the input is a model, expected a mesh for options that build one");
  if (from == formats::Kind::ela) {
    Space stated = Space::unknown;
    model::Model model = run.timed("read", [&] { return read_ela(input, run.context(), &stated); });
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
  if (tetrahedra) {
    at(input.name(), [&] { number_parts(a.build.material, {}); });
    return solid_source(run, input, from, a);
  }
  refuse(!a.solid && (a.values.poisson || a.values.law || a.values.prony || a.order != 2),
         for_solids);
  const formats::MeshReadOptions options{.kind = from,
                                         .unit = a.unit,
                                         .weld = formats::weld_from_name(a.weld),
                                         .max_memory = run.context().max_memory};
  formats::MeshReadStats read;
  TriangleMesh mesh = run.timed("read", [&] { return read_mesh(input, options, &read); });
  if (map)
    at(input.name(), [&] { apply(*map, mesh); });
  at(input.name(), [&] {
    number_parts(a.build.material, read.part_names);
    require_parts(a.build.material, mesh.part);
  });
  if (a.unit.empty())
    warn_of_size(run, input.name(), mesh, {});
  return model_of_surface(run, input.name(), std::move(mesh), a);
}

void fix_nodes(model::Model& model, const ModelArguments& a) {
  const auto load = [](const std::string& name) { return formats::Input(name, false).read_all(); };
  if (a.fixed)
    for (const auto node : select_nodes(model, *a.fixed, load, model::SelectorScope::body))
      model.nodes[node].fixed |= *model::fixed_axes_from_name(a.axes);
}

void warn_of_laws(Run& run, const model::Model& model) {
  for (const model::Material& m : model.materials)
    if (const std::string paths = m.law ? instability_text(*m.law) : ""; !paths.empty())
      run.warn(model.name + ": material '" + m.name + "': " + law_text(*m.law) +
               " is unstable in " + paths + ", expected smaller strains or other parameters");
}

} // namespace gewebe::cli
