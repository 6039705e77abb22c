// exp2ela: mesh or primitive -> deformable model; model -> model or mesh.

#include "formats/mesh/mesh_file.h"
#include "formats/model/ela.h"
#include "formats/model/solid_deck.h"
#include "formats/tetrahedra/tet_file.h"
#include "model/build.h"
#include "model/figures.h"
#include "tools/cli/cli.h"
#include "tools/cli/space_option.h"
#include "tools/cli/transform_option.h"
#include "tools/model/model_arguments.h"
#include "tools/model/model_fit.h"
#include "tools/model/model_source.h"
#include "tools/model/net_source.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

using namespace gewebe;

namespace {

std::vector<formats::Kind> and_ela(std::vector<formats::Kind> kinds) {
  kinds.push_back(formats::Kind::ela);
  return kinds;
}

/// Meshes, models, and solids for other solvers.
std::vector<formats::Kind> all_outputs() {
  std::vector<formats::Kind> kinds = and_ela(formats::writable_mesh_kinds());
  kinds.insert(kinds.end(), formats::solid_deck_kinds().begin(), formats::solid_deck_kinds().end());
  return kinds;
}

std::vector<formats::Kind> all_inputs() {
  std::vector<formats::Kind> kinds = and_ela(formats::readable_mesh_kinds());
  for (const formats::Kind kind : formats::readable_tet_kinds())
    if (std::ranges::find(kinds, kind) == kinds.end())
      kinds.push_back(kind);
  return kinds;
}

void hold_step(cli::Run& run, model::Model& model, const cli::ModelArguments& a) {
  if (!a.dt)
    return;
  if (a.scale_mass)
    run.stats().set("scaled_masses", std::uint64_t{scale_masses(model, *a.dt)});
  require_safe_step(model, *a.dt);
}

void report_steps(cli::Run& run, const model::Model& model) {
  const std::vector<double> steps = safe_steps(model);
  const auto min = std::min_element(steps.begin(), steps.end());
  run.stats().set("safe_step", *min);
  run.stats().set("safe_step_node", static_cast<std::uint64_t>(min - steps.begin()));
}

void work(cli::Run& run, cli::ModelArguments& a) {
  if (!a.materials.empty())
    choose_materials(a);
  const formats::Kind to = output_kind(run.to(), run.output(), formats::Kind::ela, all_outputs());
  formats::Output output(run.output(), run.output_options(is_binary(to)));
  Space space = Space::unknown;
  model::Model model = cli::model_source(run, a, space);
  if (!a.name.empty())
    model.name = a.name;
  cli::fix_nodes(model, a);
  if (!a.fit.empty())
    cli::fit_model(run, model, a.fit);
  const bool deck =
      std::ranges::find(formats::solid_deck_kinds(), to) != formats::solid_deck_kinds().end();
  if (to == formats::Kind::ela || deck) {
    cli::warn_of_hinges(run, model);
    cli::warn_of_laws(run, model);
  }
  hold_step(run, model, a);
  run.timed("write", [&] {
    if (to == formats::Kind::ela)
      write_ela(output, model, run.context(), space);
    else if (deck)
      write_solid_deck(output, model, to);
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
  cli::ModelArguments a;
  declare(p, a);
  declare_space(p, a.space);
  declare_transform(p, a.transform);
  p.output_kinds(all_outputs());
  p.input_kinds(all_inputs());
  p.operand("MESH", a.mesh, "mesh, tetrahedra or model");
  p.check([&] { complete(a); });
  return p.run(argc, argv,
               [&](cli::Run& run) { a.list_materials ? list_materials(run, a) : work(run, a); });
}
