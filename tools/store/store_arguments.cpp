#include "tools/store/store_arguments.h"

#include "columns/column_compression.h"

#include <charconv>

namespace gewebe::cli {

namespace {

/// "I/N" with 1 <= I <= N.
formats::StoreShard shard_of(const std::string& text) {
  formats::StoreShard shard;
  const char* const end = text.data() + text.size();
  const auto [slash, first] = std::from_chars(text.data(), end, shard.index);
  if (first == std::errc() && slash != end && *slash == '/') {
    const auto [last, second] = std::from_chars(slash + 1, end, shard.count);
    if (second == std::errc() && last == end && shard.index >= 1 && shard.index <= shard.count)
      return shard;
  }
  throw UsageError("--shard: '" + text + "', expected I/N with I from 1 to N, such as 2/3");
}

void refuse(bool given, const char* option, const char* beside) {
  if (given)
    throw UsageError(std::string(option) + " does not go with " + beside);
}

/// What makes no columns takes none of the options that say how.
void refuse_making(const StoreArguments& a, const char* beside) {
  refuse(a.columns != "none", "--columns", beside);
  refuse(a.compress.has_value(), "--compress", beside);
  refuse(!a.rows.empty(), "--rows", beside);
  refuse(a.method != "direct", "--method", beside);
  refuse(!a.shard_text.empty(), "--shard", beside);
  refuse(a.stage != 1, "--stage", beside);
}

void check_method(const StoreArguments& a) {
  if (!a.rows.empty() && a.columns == "none")
    throw UsageError("--rows goes with --columns");
  const bool relaxes = a.method != "direct";
  if (a.force && !relaxes)
    throw UsageError("--force goes with --method relax or relax-fixed");
  if (a.threshold && a.method != "relax")
    throw UsageError("--velocity-threshold goes with --method relax");
  if (a.steps.has_value() != (a.method == "relax-fixed"))
    throw UsageError("--steps and --method relax-fixed go together");
  if (relaxes && a.columns == "none")
    throw UsageError("--method " + a.method + " computes columns, expected --columns");
}

} // namespace

void declare(cli::Program& p, StoreArguments& a) {
  p.option("--columns", a.columns, "SELECTOR",
           "nodes whose columns are stored: all, none or a selector")
      .such_as({"all", "none"});
  p.option("--rows", a.rows, "NODES",
           "displacements in a column: surface (default for solids) or all nodes")
      .one_of({"surface", "all"});
  p.option("--precision", a.precision, "TYPE", "type of the columns: float64, float32")
      .one_of({"float64", "float32"});
  p.option("--compress", a.compress, "E",
           "compress columns with errors below E of the largest entry")
      .range(columns::min_relative, 0.1);
  p.option("--method", a.method, "METHOD", "how columns are computed: direct, relax, relax-fixed")
      .one_of({"direct", "relax", "relax-fixed"});
  p.option("--force", a.force, "F", "force of a relaxation, 1e-6 N").positive();
  p.option("--velocity-threshold", a.threshold, "T", "speed at which relax ends").positive();
  p.option("--steps", a.steps, "N", "steps of each pull with relax-fixed").range(1, 1e12);
  p.option("--stage", a.stage, "S", "2: add the models as second stage for two-step").range(1, 2);
  p.option("--shard", a.shard_text, "I/N", "compute part I of N");
  p.flag("--merge", a.merge, "join parts given instead of models");
  p.option("--update", a.update, "STORE", "make the store of a cut model from this store");
  p.option("--before", a.before, "MODEL", "with --update: model before the cut");
  p.option("--jobs", a.jobs, "N", "models read and factorised ahead").range(1, 1024);
  p.flag("--verify", a.verify, "read the store back and recompute some columns");
  p.flag("--info", a.info, "print what is in a store given instead of MODEL");
  p.operands("MODEL", a.inputs, "the models, one object each; standard input if there are none", 0);
}

void complete(StoreArguments& a) {
  if (a.update.empty() != a.before.empty())
    throw UsageError("--update and --before go together");
  if (!a.update.empty()) {
    refuse_making(a, "--update");
    refuse(a.info, "--info", "--update");
    refuse(a.merge, "--merge", "--update");
    if (a.inputs.size() != 1)
      throw UsageError("expected one cut model with --update");
    cli::check_one_pipe({a.before, a.inputs[0]});
    return;
  }
  if (a.info)
    refuse_making(a, "--info");
  refuse(a.info && a.merge, "--merge", "--info");
  if (a.info && (a.inputs.size() != 1 || a.inputs[0] == "-"))
    throw UsageError("expected the name of one store with --info");
  if (a.merge) {
    refuse_making(a, "--merge");
    if (a.inputs.empty())
      throw UsageError("expected the parts of a store with --merge");
    return;
  }
  check_method(a);
  if (a.compress) {
    if (a.columns == "none")
      throw UsageError("--compress is for columns, expected --columns");
    refuse(a.method != "direct", "--method", "--compress");
    refuse(a.precision != "float64", "--precision", "--compress");
    refuse(!a.shard_text.empty(), "--shard", "--compress");
  }
  if (!a.shard_text.empty())
    a.shard = shard_of(a.shard_text);
  refuse(a.stage == 2 && a.shard.count > 1, "--shard", "--stage 2");
  if (a.inputs.empty())
    a.inputs.emplace_back("-");
  std::vector<std::string> inputs = a.inputs;
  if (a.columns != "none") {
    try {
      a.touched = model::parse_selector(a.columns);
    } catch (const Error& error) {
      throw UsageError(std::string("--columns: ") + error.what());
    }
    const std::vector<std::string> lists = model::node_list_names(*a.touched);
    inputs.insert(inputs.end(), lists.begin(), lists.end());
  }
  cli::check_one_pipe(inputs);
}

} // namespace gewebe::cli
