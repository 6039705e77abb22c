#include "tools/store/store_making.h"

#include "columns/column_compression.h"
#include "columns/compliance_columns.h"
#include "dynamics/relaxation.h"
#include "fem/model_stiffness.h"
#include "formats/model/ela.h"
#include "linalg/condition.h"
#include "model/selector.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <future>

namespace gewebe::cli {

namespace {

/// A model whose matrix is known to be sound; nothing is written before.
struct Prepared {
  std::string name; ///< of the input
  model::Model model;
  std::vector<std::uint32_t> nodes; ///< that shall have columns
  std::uint64_t row_nodes = 0;      ///< see StiffnessFacts
  linalg::StiffnessMatrix matrix;
  std::optional<linalg::Factor> factor;
  linalg::StiffnessCheck check;
  double read = 0, assemble = 0, factorise = 0; ///< s
};

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// What columns have rows for, as StiffnessFacts says it.
std::uint64_t row_nodes_of(const model::Model& model, const StoreArguments& a) {
  if (!a.touched || a.rows == "all" || model.tetrahedra.empty())
    return 0;
  const std::size_t surface = model::surface_count(model);
  return surface < model.nodes.size() ? surface : 0;
}

std::vector<std::uint32_t> touched_nodes(const model::Model& model, const StoreArguments& a,
                                         std::uint64_t row_nodes) {
  if (!a.touched)
    return {};
  const auto load = [](const std::string& name) { return formats::Input(name, false).read_all(); };
  std::vector<std::uint32_t> nodes = model::select_nodes(model, *a.touched, load);
  if (row_nodes != 0) {
    nodes.erase(std::ranges::lower_bound(nodes, row_nodes), nodes.end());
    if (nodes.empty())
      throw Error("--columns selects nodes inside the solid alone, expected some of its surface, "
                  "or --rows all");
  }
  // Whole blocks, so that what is checked together is so in every part.
  const std::uint64_t blocks =
      (nodes.size() + columns::compliance_block - 1) / columns::compliance_block;
  const auto bound = [&](std::uint64_t shard) {
    const std::uint64_t end = blocks * shard / a.shard.count * columns::compliance_block;
    return nodes.begin() + static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(end, nodes.size()));
  };
  return {bound(a.shard.index - 1), bound(a.shard.index)};
}

/// Those of a solid are what a simulation of it keeps: their size is known before any work.
void require_columns(const Prepared& p, const StoreArguments& a, const Context& context) {
  if (p.model.tetrahedra.empty() || p.nodes.empty() || a.compress)
    return;
  const std::size_t rows = p.row_nodes != 0 ? p.row_nodes : p.model.nodes.size();
  require_memory(context,
                 formats::stored_columns_bytes(p.nodes.size(), rows, a.precision == "float32"),
                 ("the columns of " + std::to_string(p.nodes.size()) + " nodes with rows for " +
                  std::to_string(rows))
                     .c_str());
}

Prepared prepare(const std::string& path, const StoreArguments& a, const Context& context) {
  formats::Input input(path);
  Prepared p;
  p.name = input.name();
  const double start = seconds();
  p.model = formats::read_ela(input, context);
  p.read = seconds() - start;
  at(p.name, [&] {
    if (a.method != "direct" && !p.model.tetrahedra.empty())
      throw Error("holds tetrahedra, which --method " + a.method +
                  " doesn't simulate, expected --method direct");
    p.row_nodes = row_nodes_of(p.model, a);
    p.nodes = touched_nodes(p.model, a, p.row_nodes);
    require_columns(p, a, context);
    p.matrix = fem::stiffness_matrix(p.model, {}, context);
    p.assemble = seconds() - start - p.read;
    p.factor = linalg::checked_factor(p.model, p.matrix, context, p.check);
  });
  p.factorise = seconds() - start - p.read - p.assemble;
  return p;
}

/// Models in their order, some of them prepared ahead.
class Preparations {
public:
  Preparations(const std::vector<std::string>& paths, const StoreArguments& a,
               const Context& context)
      : paths_(paths), a_(a), ahead_(static_cast<std::size_t>(a.jobs)), context_(context) {
    context_.progress = nullptr;
  }

  bool more() const { return next_ < paths_.size() || !running_.empty(); }

  Prepared next() {
    // One alone is prepared here.
    const auto how = ahead_ > 1 ? std::launch::async : std::launch::deferred;
    while (next_ < paths_.size() && running_.size() < ahead_) {
      const std::string& path = paths_[next_++];
      running_.push_back(std::async(how, [&path, this] { return prepare(path, a_, context_); }));
    }
    std::future<Prepared> first = std::move(running_.front());
    running_.pop_front();
    return first.get();
  }

private:
  const std::vector<std::string>& paths_;
  const StoreArguments& a_;
  std::size_t ahead_, next_ = 0;
  Context context_;
  std::deque<std::future<Prepared>> running_;
};

formats::StiffnessMethod method_of(const StoreArguments& a) {
  formats::StiffnessMethod method;
  method.name = a.method;
  if (a.method == "direct")
    return method;
  method.force = a.force.value_or(0);
  if (a.method == "relax")
    method.threshold = a.threshold.value_or(dynamics::RelaxOptions{}.threshold);
  else
    method.steps = static_cast<std::uint64_t>(*a.steps);
  return method;
}

formats::StiffnessFacts facts_of(const Prepared& p, const StoreArguments& a) {
  formats::StiffnessFacts facts;
  facts.object = p.model.name;
  facts.hash = formats::stiffness_hash(p.model);
  facts.rest = formats::rest_hash(p.model);
  facts.nodes = p.model.nodes.size();
  facts.order = p.matrix.order();
  facts.norm = p.check.norm;
  facts.condition = p.check.condition;
  facts.single = a.precision == "float32";
  facts.compressed = a.compress.value_or(0);
  facts.method = method_of(a);
  facts.row_nodes = p.row_nodes;
  if (a.touched)
    linalg::require_precision(facts.condition, facts.single);
  return facts;
}

/// Columns of clusters of nodes, compressed as they come. \return their residual
double compress(cli::Run& run, const Prepared& p, double relative,
                formats::StiffnessStoreWriter& writer) {
  const std::size_t rows = p.row_nodes != 0 ? p.row_nodes : p.model.nodes.size();
  std::vector<Vec3> positions; // of the nodes with rows
  for (std::size_t i = 0; i < rows; ++i)
    positions.push_back(p.model.nodes[i].position);
  Context quiet = run.context();
  quiet.progress = nullptr;
  const auto columns_of = [&](std::span<const std::uint32_t> nodes, columns::ColumnSink& sink) {
    return columns::compliance_columns(p.matrix, *p.factor, p.check.norm, nodes, quiet, sink, rows);
  };
  const columns::CompressedMade made = run.timed("columns", [&] {
    return columns::compress_columns(positions, p.nodes, relative, columns_of, run.context());
  });
  run.timed("write", [&] { writer.write_compressed(made); });
  return made.residual;
}

/// The group of the second stage of the object that the model belongs to.
std::string second_stage_of(const formats::StiffnessStore& store,
                            const formats::StiffnessFacts& second) {
  std::string names;
  for (const std::string& group : store.objects()) {
    const formats::StiffnessFacts first = store.facts(group);
    names += (names.empty() ? "'" : ", '") + first.object + "'";
    if (first.object != second.object)
      continue;
    if (first.rest != second.rest || first.order != second.order)
      throw Error("'" + second.object + "' has other nodes or constraints than in " + store.path() +
                  ", expected the same except springs");
    return formats::second_stage_group(group);
  }
  throw Error("no object '" + second.object + "' in " + store.path() + ", which holds " +
              (names.empty() ? "nothing" : names));
}

void compute(cli::Run& run, const Prepared& p, const formats::StiffnessMethod& method,
             const std::vector<std::uint32_t>& nodes, formats::StiffnessStoreWriter& writer) {
  run.timed("columns", [&] {
    if (method.name == "direct") {
      (void)columns::compliance_columns(p.matrix, *p.factor, p.check.norm, nodes, run.context(),
                                        writer, p.row_nodes != 0 ? p.row_nodes : SIZE_MAX);
      return;
    }
    const dynamics::RelaxFigures figures = dynamics::relaxed_columns(
        p.model, p.matrix, *p.factor, p.check.norm, nodes,
        {method.force, method.threshold, method.steps}, run.context(), writer);
    run.stats().set("relax_steps", figures.steps);
    run.stats().set("relax_pulls", figures.pulls);
  });
}

} // namespace

void add(StoreTotals& totals, const formats::StiffnessFacts& facts,
         const linalg::StiffnessMatrix& matrix, const linalg::Factor& factor, std::size_t nodes,
         double residual) {
  totals = {totals.objects + 1,
            totals.nodes + facts.nodes,
            totals.order + facts.order,
            totals.matrix + 2 * matrix.row.size() - matrix.order(),
            totals.factor + factor.entries(),
            totals.columns + 3 * nodes,
            std::max(totals.norm, facts.norm),
            std::max(totals.condition, facts.condition),
            std::max(totals.residual, residual)};
}

void add_models(cli::Run& run, const StoreArguments& a, const formats::StiffnessStore* store,
                formats::StiffnessStoreWriter& writer, StoreTotals& totals) {
  // Without columns, shards take turns with the objects.
  std::vector<std::string> inputs;
  for (std::size_t i = 0; i < a.inputs.size(); ++i)
    if (a.touched || i % a.shard.count == a.shard.index - 1)
      inputs.push_back(a.inputs[i]);
  Preparations preparations(inputs, a, run.context());
  while (preparations.more()) {
    const Prepared p = preparations.next();
    run.stats().seconds("read", p.read);
    run.stats().seconds("matrix", p.assemble);
    run.stats().seconds("factor", p.factorise);
    at(p.name, [&] {
      formats::StiffnessFacts facts = facts_of(p, a);
      if (store != nullptr)
        facts.group = second_stage_of(*store, facts);
      const auto missing =
          run.timed("write", [&] { return writer.begin(facts, p.matrix, *p.factor, p.nodes); });
      report_kept(run, writer);
      double residual = p.check.residual;
      if (facts.compressed > 0)
        residual = std::max(residual, compress(run, p, facts.compressed, writer));
      else
        compute(run, p, facts.method, missing, writer);
      residual = run.timed("write", [&] { return writer.end(residual); });
      add(totals, facts, p.matrix, *p.factor, p.nodes.size(), residual);
    });
  }
}

} // namespace gewebe::cli
