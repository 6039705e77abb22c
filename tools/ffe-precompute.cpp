// ffe-precompute: model -> stiffness store.

#include "base/digest.h"
#include "formats/ela.h"
#include "formats/stiffness_store_writer.h"
#include "model/selector.h"
#include "sim/compliance_columns.h"
#include "sim/condition.h"
#include "tools/cli.h"
#include "tools/store_info.h"

#include <algorithm>
#include <filesystem>

using namespace gewebe;
namespace {

struct Arguments {
  std::string model = "-", columns = "none", precision = "float64";
  bool info = false, verify = false;
  std::optional<Selector> touched;
};

void complete(Arguments& a) {
  if (a.info && a.columns != "none")
    throw UsageError("--columns does not go with --info");
  if (a.info && a.model == "-")
    throw UsageError("expected the name of a store with --info");
  if (a.columns == "none")
    return;
  try {
    a.touched = parse_selector(a.columns);
  } catch (const Error& error) {
    throw UsageError(std::string("--columns: ") + error.what());
  }
  std::vector<std::string> inputs = node_list_names(*a.touched);
  inputs.push_back(a.model);
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

void report(cli::Run& run, const Model& model, const Work& w, std::size_t columns, double residual,
            const StiffnessStoreWriter& writer) {
  const auto set = [&](const char* key, std::size_t value) {
    run.stats().set(key, std::uint64_t{value});
  };
  set("nodes", model.nodes.size());
  set("free_axes", w.matrix.order());
  set("matrix_nonzeros", 2 * w.matrix.row.size() - w.matrix.order());
  set("factor_nonzeros", w.factor->entries());
  run.stats().set("norm", w.check.norm);
  run.stats().set("condition", w.check.condition);
  run.stats().set("residual", residual);
  set("columns", 3 * columns);
  set("bytes", std::filesystem::file_size(run.output()));
  run.stats().set("matrix_digest", digest_text(writer.matrix_digest()));
  run.stats().set("digest", digest_text(writer.digest()));
}

StiffnessFacts facts_of(const Model& model, const Work& w, const Arguments& a) {
  StiffnessFacts facts;
  facts.object = model.name;
  facts.hash = stiffness_hash(model);
  facts.nodes = model.nodes.size();
  facts.order = w.matrix.order();
  facts.norm = w.check.norm;
  facts.condition = w.check.condition;
  facts.single = a.precision == "float32";
  return facts;
}

void work(cli::Run& run, const Arguments& a) {
  if (run.output() == "-")
    throw UsageError("expected -o FILE, since a store cannot go to standard output");
  Output::Options options = run.output_options(true);
  options.sync = true;
  Output output(run.output(), options);
  (void)output.temporary(); // what is no file is refused before the work
  Input input(a.model);
  const Model model = run.timed("read", [&] { return read_ela(input, run.context()); });
  const auto nodes = at(input.name(), [&] { return touched_nodes(model, a); });
  const Work w = at(input.name(), [&] { return prepare(run, model); });

  std::optional<StiffnessStoreWriter> writer;
  run.timed("write",
            [&] { writer.emplace(output, facts_of(model, w, a), w.matrix, *w.factor, nodes); });
  const double columns = run.timed("columns", [&] {
    return at(input.name(), [&] {
      return compliance_columns(w.matrix, *w.factor, w.check.norm, nodes, run.context(), *writer);
    });
  });
  const double residual = std::max(w.check.residual, columns);
  run.timed("write", [&] { writer->close(residual); });
  if (a.verify) // what the disk holds, before it takes its name
    run.timed("verify",
              [&] { verify_store(run, StiffnessStore(output.temporary()), run.output()); });
  output.commit();
  if (run.stats_wanted())
    report(run, model, w, nodes.size(), residual, *writer);
}

} // namespace

int main(int argc, char** argv) {
  cli::Program p("ffe-precompute",
                 "Factorises the stiffness of a model and stores it, with columns "
                 "of its inverse on request.");
  Arguments a;
  p.option("--columns", a.columns, "SELECTOR", "nodes whose columns are stored, all or none");
  p.option("--precision", a.precision, "TYPE", "of the columns: float64, float32")
      .one_of({"float64", "float32"});
  p.flag("--verify", a.verify, "read the store back and recompute some columns another way");
  p.flag("--info", a.info, "say what is in a store, which stands in the place of MODEL");
  p.operand("MODEL", a.model, "the model");
  p.check([&] { complete(a); });
  return p.run(argc, argv,
               [&](cli::Run& run) { a.info ? print_store(run, a.model, a.verify) : work(run, a); });
}
