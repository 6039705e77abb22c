#include "tools/model/net_source.h"

#include "model/build.h"
#include "model/hinge.h"
#include "tools/model/solid_source.h"

#include <string>
#include <utility>
#include <vector>

namespace gewebe::cli {

namespace {

void repair(Run& run, const std::string& name, TriangleMesh& mesh, const ModelArguments& a) {
  const repair::RepairReport report = run.timed("repair", [&] {
    return at(name, [&] { return repair::repair_mesh(mesh, a.repairs, run.context()); });
  });
  for (const repair::RepairReport::Line& line : report.lines()) {
    run.stats().set(line.key, line.count);
    if (line.count == 0)
      continue;
    const std::string text = name + ": " + std::to_string(line.count) + " " + line.text;
    line.trouble ? run.warn(text) : run.say(text);
  }
}

} // namespace

model::Model model_of_surface(Run& run, const std::string& name, TriangleMesh mesh,
                              const ModelArguments& a) {
  if (!a.repair.empty())
    repair(run, name, mesh, a);
  if (a.solid)
    return filled_surface(run, name, mesh, a);
  model::BuiltModel built = run.timed("build", [&] {
    return at(name, [&] { return model::build_model(mesh, a.build, run.context()); });
  });
  for (const model::BuildReport::Line& line : built.report.lines()) {
    run.stats().set(line.key, std::uint64_t{line.count});
    if (line.count > 0 && line.warning != nullptr)
      run.warn(name + ": " + std::to_string(line.count) + " " + line.warning);
  }
  return std::move(built.model);
}

/// Few central nodes hold a part of few nodes.
void warn_of_hinges(Run& run, const model::Model& model) {
  const std::vector<model::Hinged> hinged = model::hinged_components(model);
  run.stats().set("hinged_components", std::uint64_t{hinged.size()});
  if (hinged.empty())
    return;
  const model::Hinged& first = hinged.front();
  run.warn(model.name + ": component " + std::to_string(first.component) + " of " +
           std::to_string(first.nodes) + " nodes" +
           (hinged.size() == 1 ? "" : " and " + std::to_string(hinged.size() - 1) + " more") +
           " can turn about what holds it (" + std::to_string(first.held) +
           (first.held == 1 ? " node" : " nodes on one line") +
           "), expected three places or more: mc-opt --components largest leaves small parts "
           "out, --centrals sets the number");
}

} // namespace gewebe::cli
