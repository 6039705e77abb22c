#include "tools/store_update.h"

#include "formats/ela.h"
#include "model/cut_origin.h"
#include "sim/axis_solver.h"
#include "sim/compliance_columns.h"
#include "sim/condition.h"
#include "sim/corrected_columns.h"
#include "tools/store_making.h"

#include <algorithm>
#include <limits>
#include <memory>

namespace gewebe {

namespace {

/// A cut model whose matrix is known to be sound.
struct CutObject {
  Model model;
  StiffnessMatrix matrix;
  std::shared_ptr<AxisSolver> solver;
  StiffnessCheck check;
};

/// What stands between corrected columns and the store: sums of them, put back into K u = f.
class Checked {
public:
  Checked(const CutObject& cut, double most) : cut_(cut), most_(most) {}

  /// Hands a block of columns on; those that err by more than they may are solved for.
  void write(std::span<const std::uint32_t> nodes, std::span<double> columns, std::size_t first,
             StiffnessStoreWriter& writer) {
    double error = residual(nodes, columns);
    if (!(error <= most_)) {
      solve(nodes, columns);
      error = residual(nodes, columns);
      if (!(error <= max_backward_error))
        throw Error("a column has a backward error beyond 1e-14");
      solved_ += 3 * nodes.size();
    }
    const std::size_t each = columns.size() / nodes.size();
    for (std::size_t k = 0; k < nodes.size(); ++k)
      writer.write(first + k, columns.subspan(k * each, each), error);
  }
  std::uint64_t solved() const { return solved_; }

private:
  double residual(std::span<const std::uint32_t> nodes, std::span<const double> columns) const {
    const std::size_t order = cut_.matrix.order(), axes = cut_.matrix.row_of_axis.size();
    std::vector<double> sum(order), load(order);
    for (std::size_t c = 0; c < 3 * nodes.size(); ++c) {
      const double weight = 1 + static_cast<double>(c) / 32;
      const std::int64_t row = cut_.matrix.row_of_axis[3 * std::size_t{nodes[c / 3]} + c % 3];
      if (row >= 0)
        load[static_cast<std::size_t>(row)] = weight;
      for (std::size_t r = 0; r < order; ++r)
        sum[r] += weight * columns[c * axes + static_cast<std::size_t>(cut_.matrix.axis_of_row[r])];
    }
    return backward_error(cut_.matrix, cut_.check.norm, sum, load);
  }

  void solve(std::span<const std::uint32_t> nodes, std::span<double> columns) const {
    const std::size_t axes = cut_.matrix.row_of_axis.size();
    std::fill(columns.begin(), columns.end(), 0.0);
    for (std::size_t c = 0; c < 3 * nodes.size(); ++c)
      columns[c * axes + 3 * std::size_t{nodes[c / 3]} + c % 3] = 1;
    cut_.solver->solve(columns, 3 * nodes.size());
  }

  const CutObject& cut_;
  double most_;
  std::uint64_t solved_ = 0;
};

CutObject prepare(cli::Run& run, const std::string& path) {
  CutObject cut;
  run.timed("read", [&] {
    Input input(path);
    cut.model = read_ela(input, run.context());
  });
  at(path, [&] {
    run.timed("matrix", [&] { cut.matrix = stiffness_matrix(cut.model); });
    run.timed("factor", [&] {
      Factor factor = checked_factor(cut.model, cut.matrix, run.context(), cut.check);
      cut.solver =
          std::make_shared<AxisSolver>(AxisSolver{std::move(factor), cut.matrix.row_of_axis});
    });
  });
  return cut;
}

AxesSolve solver_of(std::shared_ptr<AxisSolver> solver) {
  return [solver = std::move(solver)](std::span<double> over_axes, std::size_t columns) {
    solver->solve(over_axes, columns);
  };
}

void update_object(cli::Run& run, const Model& before, const StiffnessFacts& facts,
                   const CutObject& cut, const StiffnessStore& store, StiffnessStoreWriter& writer,
                   StoreTotals& totals) {
  const CutOrigin maps = find_cut_origin(before, cut.model);
  StiffnessChange change = stiffness_change(before, cut.model, maps.origin, maps.place);
  run.stats().set("rank", std::uint64_t{change.rank()});
  StiffnessFacts now;
  now.object = cut.model.name;
  now.hash = stiffness_hash(cut.model);
  now.rest = rest_hash(cut.model);
  now.nodes = cut.model.nodes.size();
  now.order = cut.matrix.order();
  now.norm = cut.check.norm;
  now.condition = cut.check.condition;
  now.single = facts.single;

  std::shared_ptr<const ColumnSource> stored = store.columns(facts);
  if (!stored) {
    (void)writer.begin(now, cut.matrix, cut.solver->factor, {});
    add(totals, now, cut.matrix, cut.solver->factor, 0, writer.end(cut.check.residual));
    return;
  }
  require_precision(now.condition, now.single);
  AxesSolve solve_before;
  if (now.single)
    solve_before =
        solver_of(std::make_shared<AxisSolver>(stored_axes(before, store.factor(facts))));
  const CorrectedColumns corrected(stored, std::move(change), solver_of(cut.solver), run.context(),
                                   std::move(solve_before), cut.solver->factor.entries());
  const std::vector<std::uint32_t>& nodes = corrected.nodes();
  const std::vector<std::uint32_t> missing =
      run.timed("write", [&] { return writer.begin(now, cut.matrix, cut.solver->factor, nodes); });
  if (missing.size() != nodes.size())
    throw Error("columns of the new store stand there already, expected none");
  std::uint64_t made = 3 * nodes.size();
  run.timed("columns", [&] {
    if (!corrected.pays(nodes.size())) {
      made = 0;
      (void)compliance_columns(cut.matrix, cut.solver->factor, cut.check.norm, nodes, run.context(),
                               writer);
      return;
    }
    Checked checked(cut, now.single ? static_cast<double>(std::numeric_limits<float>::epsilon())
                                    : max_backward_error);
    const std::size_t each = 9 * cut.model.nodes.size();
    std::vector<double> columns(each * compliance_block);
    for (std::size_t k = 0; k < nodes.size(); k += compliance_block) {
      if (run.context().cancelled && run.context().cancelled())
        throw Cancelled();
      const std::size_t count = std::min(compliance_block, nodes.size() - k);
      const auto some = std::span(columns).first(each * count);
      corrected.read(k, count, some);
      checked.write(std::span(nodes).subspan(k, count), some, k, writer);
      if (run.context().progress)
        run.context().progress(static_cast<double>(k + count) / static_cast<double>(nodes.size()));
    }
    made -= checked.solved();
  });
  run.stats().set("corrected_columns", made);
  const double residual = run.timed("write", [&] { return writer.end(cut.check.residual); });
  add(totals, now, cut.matrix, cut.solver->factor, nodes.size(), residual);
}

} // namespace

void update_store(cli::Run& run, const StoreArguments& a, const StiffnessStore& store,
                  StiffnessStoreWriter& writer, StoreTotals& totals) {
  if (store.shard().count > 1)
    throw Error(store.path(), "is part of a store, expected a whole one (ffe-precompute --merge)");
  Input input(a.before);
  const Model before = read_ela(input, run.context());
  const StiffnessFacts facts = store.facts(before);
  if (store.second_stage(facts))
    throw Error(store.path(),
                "'" + facts.object + "' has a second stage, expected --stage 2 after --update");
  if (facts.method.name != "direct")
    throw Error(store.path(), "'" + facts.object + "' has columns of method " + facts.method.name +
                                  ", expected direct ones");
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

} // namespace gewebe
