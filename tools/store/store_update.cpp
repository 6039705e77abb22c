#include "tools/store/store_update.h"

#include "compliance/axis_solver.h"
#include "cutting/cut_origin.h"
#include "fem/model_stiffness.h"
#include "formats/model/ela.h"
#include "linalg/condition.h"
#include "tools/store/store_making.h"
#include "tools/store/store_merging.h"
#include "update/corrected_columns.h"
#include "update/corrected_compliance.h"

#include <memory>
#include <string>

namespace gewebe::cli {

namespace {

/// Of a solid a cut changes the stiffness at all nodes of the elements beside it, mostly at a third
/// to a half as many axes as there are columns. Correcting a column takes that many products for
/// each of its rows, more than the two for each entry of the factor that solving for it takes.
model::Model read_net(const std::string& path, const Context& context) {
  formats::Input input(path);
  model::Model model = formats::read_ela(input, context);
  if (!model.tetrahedra.empty())
    throw Error(path, "the model '" + model.name + "' holds " +
                          std::to_string(model.tetrahedra.size()) +
                          " tetrahedra, whose cuts change the stiffness at so many nodes that "
                          "correcting columns takes longer than solving for them, expected a net: "
                          "make the store of a cut solid without --update");
  return model;
}

/// A cut model whose matrix is known to be sound.
struct CutObject {
  model::Model model;
  linalg::StiffnessMatrix matrix;
  std::shared_ptr<compliance::AxisSolver> solver;
  linalg::StiffnessCheck check;
};

CutObject prepare(cli::Run& run, const std::string& path) {
  CutObject cut;
  run.timed("read", [&] { cut.model = read_net(path, run.context()); });
  at(path, [&] {
    run.timed("matrix", [&] { cut.matrix = fem::stiffness_matrix(cut.model); });
    run.timed("factor", [&] {
      linalg::Factor factor =
          linalg::checked_factor(cut.model, cut.matrix, run.context(), cut.check);
      cut.solver = std::make_shared<compliance::AxisSolver>(
          compliance::AxisSolver{std::move(factor), cut.matrix.row_of_axis});
    });
  });
  return cut;
}

update::AxesSolve solver_of(std::shared_ptr<compliance::AxisSolver> solver) {
  return [solver = std::move(solver)](std::span<double> over_axes, std::size_t columns) {
    solver->solve(over_axes, columns);
  };
}

void update_object(cli::Run& run, const model::Model& before, const formats::StiffnessFacts& facts,
                   const CutObject& cut, const formats::StiffnessStore& store,
                   formats::StiffnessStoreWriter& writer, StoreTotals& totals) {
  const cutting::CutOrigin maps = cutting::find_cut_origin(before, cut.model);
  update::StiffnessChange change =
      update::stiffness_change(before, cut.model, maps.origin, maps.place);
  run.stats().set("rank", std::uint64_t{change.rank()});
  formats::StiffnessFacts now;
  now.object = cut.model.name;
  now.hash = formats::stiffness_hash(cut.model);
  now.rest = formats::rest_hash(cut.model);
  now.nodes = cut.model.nodes.size();
  now.order = cut.matrix.order();
  now.norm = cut.check.norm;
  now.condition = cut.check.condition;
  now.single = facts.single;

  std::shared_ptr<const columns::ColumnSource> stored = store.columns(facts);
  if (!stored) {
    (void)writer.begin(now, cut.matrix, cut.solver->factor, {});
    add(totals, now, cut.matrix, cut.solver->factor, 0, writer.end(cut.check.residual));
    return;
  }
  linalg::require_precision(now.condition, now.single);
  update::AxesSolve solve_before;
  if (now.single)
    solve_before = solver_of(std::make_shared<compliance::AxisSolver>(
        compliance::stored_axes(before, store.factor(facts))));
  const update::CorrectedColumns corrected(stored, std::move(change), solver_of(cut.solver),
                                           run.context(), std::move(solve_before),
                                           cut.solver->factor.entries());
  const std::vector<std::uint32_t>& nodes = corrected.nodes();
  const std::vector<std::uint32_t> missing =
      run.timed("write", [&] { return writer.begin(now, cut.matrix, cut.solver->factor, nodes); });
  if (missing.size() != nodes.size())
    throw Error("columns of the new store stand there already, expected none");
  const update::CorrectedCompliance made = run.timed("columns", [&] {
    return update::corrected_compliance(cut.matrix, *cut.solver, cut.check.norm, corrected,
                                        run.context(), writer);
  });
  run.stats().set("corrected_columns", std::uint64_t{made.corrected});
  const double residual = run.timed("write", [&] { return writer.end(cut.check.residual); });
  add(totals, now, cut.matrix, cut.solver->factor, nodes.size(), residual);
}

} // namespace

void update_store(cli::Run& run, const StoreArguments& a, const formats::StiffnessStore& store,
                  formats::StiffnessStoreWriter& writer, StoreTotals& totals) {
  if (store.shard().count > 1)
    throw Error(store.path(), "is part of a store, expected a whole one (ffe-precompute --merge)");
  const model::Model before = read_net(a.before, run.context());
  const formats::StiffnessFacts facts = store.facts(before);
  if (store.second_stage(facts))
    throw Error(store.path(),
                "'" + facts.object + "' has a second stage, expected --stage 2 after --update");
  if (facts.method.name != "direct")
    throw Error(store.path(), "'" + facts.object + "' has columns of method " + facts.method.name +
                                  ", expected direct ones");
  if (facts.compressed > 0)
    throw Error(store.path(), "'" + facts.object + "' has compressed columns, expected plain ones");
  const CutObject cut = prepare(run, a.inputs[0]);
  for (const std::string& group : store.objects()) {
    if (group == facts.group) {
      at(a.inputs[0], [&] { update_object(run, before, facts, cut, store, writer, totals); });
      continue;
    }
    if (store.second_stage(store.facts(group)))
      throw Error(store.path(),
                  "'" + group + "' has a second stage, expected --stage 2 after --update");
    copy_object(store, group, writer, totals);
  }
}

} // namespace gewebe::cli
