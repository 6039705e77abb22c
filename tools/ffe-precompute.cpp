// ffe-precompute: model -> stiffness store.

#include "formats/ela.h"
#include "formats/stiffness_store_writer.h"
#include "model/selector.h"
#include "sim/compliance_columns.h"
#include "sim/condition.h"
#include "tools/cli.h"
#include "tools/store_info.h"

#include <algorithm>

using namespace gewebe;
namespace {

struct Arguments {
  std::vector<std::string> models; ///< the store, for --info
  std::string columns = "none", precision = "float64";
  bool info = false, verify = false;
  std::optional<Selector> touched;
};

void complete(Arguments& a) {
  if (a.info && a.columns != "none")
    throw UsageError("--columns does not go with --info");
  if (a.info && (a.models.size() != 1 || a.models[0] == "-"))
    throw UsageError("expected the name of one store with --info");
  if (a.models.empty())
    a.models.emplace_back("-");
  std::vector<std::string> inputs = a.models;
  if (a.columns != "none") {
    try {
      a.touched = parse_selector(a.columns);
    } catch (const Error& error) {
      throw UsageError(std::string("--columns: ") + error.what());
    }
    const std::vector<std::string> lists = node_list_names(*a.touched);
    inputs.insert(inputs.end(), lists.begin(), lists.end());
  }
  cli::check_one_pipe(inputs);
}

std::vector<std::uint32_t> touched_nodes(const Model& model, const Arguments& a) {
  if (!a.touched)
    return {};
  const auto load = [](const std::string& name) { return Input(name, false).read_all(); };
  return select_nodes(model, *a.touched, load);
}

/// Nothing is written before it is known that the matrix is sound.
struct Work {
  StiffnessMatrix matrix;
  std::optional<Factor> factor;
  StiffnessCheck check;
};

Work prepare(cli::Run& run, const Model& model) {
  Work w;
  w.matrix = run.timed("matrix", [&] { return stiffness_matrix(model); });
  run.timed("factor", [&] { w.factor = checked_factor(model, w.matrix, run.context(), w.check); });
  return w;
}

StiffnessFacts facts_of(const Model& model, const Work& w, const Arguments& a) {
  StiffnessFacts facts;
  facts.object = model.name;
  facts.hash = stiffness_hash(model);
  facts.rest = rest_hash(model);
  facts.nodes = model.nodes.size();
  facts.order = w.matrix.order();
  facts.norm = w.check.norm;
  facts.condition = w.check.condition;
  facts.single = a.precision == "float32";
  return facts;
}

void add_object(cli::Run& run, const Arguments& a, const std::string& name,
                StiffnessStoreWriter& writer, StoreTotals& totals) {
  Input input(name);
  const Model model = run.timed("read", [&] { return read_ela(input, run.context()); });
  at(input.name(), [&] {
    const auto nodes = touched_nodes(model, a);
    const Work w = prepare(run, model);
    const auto missing = run.timed(
        "write", [&] { return writer.begin(facts_of(model, w, a), w.matrix, *w.factor, nodes); });
    report_kept(run, writer);
    run.timed("columns", [&] {
      compliance_columns(w.matrix, *w.factor, w.check.norm, missing, run.context(), writer);
    });
    const double residual = run.timed("write", [&] { return writer.end(w.check.residual); });
    totals = {totals.objects + 1,
              totals.nodes + model.nodes.size(),
              totals.order + w.matrix.order(),
              totals.matrix + 2 * w.matrix.row.size() - w.matrix.order(),
              totals.factor + w.factor->entries(),
              totals.columns + 3 * nodes.size(),
              std::max(totals.norm, w.check.norm),
              std::max(totals.condition, w.check.condition),
              std::max(totals.residual, residual)};
  });
}

void work(cli::Run& run, const Arguments& a) {
  if (run.output() == "-")
    throw UsageError("expected -o FILE, since a store cannot go to standard output");
  Output::Options options = run.output_options(true);
  options.sync = true;
  options.part = a.touched.has_value();
  Output output(run.output(), options);
  StiffnessStoreWriter writer(output); // what is no file is refused before the work
  StoreTotals totals;
  for (const std::string& name : a.models)
    add_object(run, a, name, writer, totals);
  writer.close();
  if (a.verify) // what the disk holds, before it takes its name
    run.timed("verify",
              [&] { verify_store(run, StiffnessStore(output.temporary()), run.output()); });
  output.commit();
  writer.remove_journal();
  if (run.stats_wanted())
    report_store(run, totals, writer);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("ffe-precompute",
                 "Factorises the stiffness of models and stores it, with columns of its "
                 "inverse on request.");
  Arguments a;
  p.option("--columns", a.columns, "SELECTOR", "nodes whose columns are stored, all or none");
  p.option("--precision", a.precision, "TYPE", "of the columns: float64, float32")
      .one_of({"float64", "float32"});
  p.flag("--verify", a.verify, "read the store back and recompute some columns another way");
  p.flag("--info", a.info, "say what is in a store, which stands in the place of MODEL");
  p.operands("MODEL", a.models, "the models, one object each; standard input if there are none", 0);
  p.check([&] { complete(a); });
  return p.run(argc, argv, [&](cli::Run& run) {
    a.info ? print_store(run, a.models[0], a.verify) : work(run, a);
  });
}
