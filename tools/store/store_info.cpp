#include "tools/store/store_info.h"

#include "base/digest.h"
#include "columns/compressed_columns.h"
#include "columns/verify.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>

namespace gewebe::cli {

namespace {

constexpr std::size_t recomputed_nodes = 3;

std::string number(const char* format, double value) {
  char text[64];
  (void)std::snprintf(text, sizeof text, format,
                      value); // NOLINT(clang-diagnostic-format-nonliteral)
  return text;
}

columns::Verification verify_object(const formats::StiffnessStore& store,
                                    const formats::StiffnessFacts& facts, const Context& context) {
  const linalg::StiffnessMatrix matrix = store.matrix(facts);
  const linalg::Factor factor = store.factor(facts);
  const std::unique_ptr<columns::ColumnSource> columns = store.columns(facts);
  const columns::CompressedColumns* const compressed = columns ? columns->compressed() : nullptr;
  const double bound = compressed != nullptr ? compressed->layout().bound : 0;
  // A relaxation that came to rest.
  const double method_error = facts.method.name == "direct" ? 0 : 1e-6;
  return columns::verify_compliance(
      matrix, factor, columns.get(),
      {facts.condition, facts.single, method_error, bound, recomputed_nodes}, context);
}

/// Of all objects, each followed by its second stage.
std::vector<formats::StiffnessFacts> all_facts(const formats::StiffnessStore& store) {
  std::vector<formats::StiffnessFacts> all;
  for (const std::string& group : store.objects()) {
    all.push_back(store.facts(group));
    if (const auto second = store.second_stage(all.back()))
      all.push_back(*second);
  }
  return all;
}

std::string describe(const formats::StiffnessFacts& facts, const formats::StiffnessSizes& sizes) {
  const bool second = facts.group.find('/') != std::string::npos;
  std::string text = "object " + facts.object + (second ? " stage 2" : "") + "\n";
  const auto line = [&](const char* key, const std::string& value) {
    text += std::string("  ") + key + " " + value + "\n";
  };
  line("hash", digest_text(facts.hash));
  line("nodes", std::to_string(facts.nodes));
  line("free_axes", std::to_string(facts.order));
  line("matrix_nonzeros", std::to_string(2 * sizes.matrix - facts.order));
  line("factor_nonzeros", std::to_string(sizes.factor));
  line("factor_mb", number("%.1f", static_cast<double>(sizes.factor) * 8e-6));
  line("touched_nodes", std::to_string(sizes.touched));
  if (facts.row_nodes != 0)
    line("row_nodes", std::to_string(facts.row_nodes));
  line("columns_mb", number("%.1f", static_cast<double>(sizes.column_bytes) * 1e-6));
  if (facts.compressed > 0)
    line("compressed", number("%.6g", facts.compressed));
  line("method", facts.method.name);
  if (facts.method.force > 0)
    line("force", number("%.6g", facts.method.force));
  if (facts.method.name == "relax")
    line("velocity_threshold", number("%.6g", facts.method.threshold));
  if (facts.method.name == "relax-fixed")
    line("steps", std::to_string(facts.method.steps));
  line("precision", facts.single ? "float32" : "float64");
  line("norm", number("%.6g", facts.norm));
  line("condition", number("%.3g", facts.condition));
  line("residual", number("%.2g", facts.residual));
  return text;
}

std::string describe(const columns::Verification& v) {
  return "  verified_columns " + std::to_string(v.columns_read) + "\n  recomputed_columns " +
         std::to_string(v.recomputed) + "\n  difference " + number("%.2g", v.difference) +
         "\n  asymmetry " + number("%.2g", v.asymmetry) + "\n  tolerance " +
         number("%.2g", v.tolerance) + "\n";
}

/// Sums and worst figures over objects.
void add(columns::Verification& total, const columns::Verification& v) {
  total.columns_read += v.columns_read;
  total.recomputed += v.recomputed;
  total.difference = std::max(total.difference, v.difference);
  total.asymmetry = std::max(total.asymmetry, v.asymmetry);
  total.tolerance = std::max(total.tolerance, v.tolerance);
}

void report(cli::Run& run, const columns::Verification& v) {
  run.stats().set("verified_columns", std::uint64_t{v.columns_read});
  run.stats().set("recomputed_columns", std::uint64_t{v.recomputed});
  run.stats().set("difference", v.difference);
  run.stats().set("asymmetry", v.asymmetry);
  run.stats().set("tolerance", v.tolerance);
}

} // namespace

void print_store(cli::Run& run, const std::string& path, bool verify) {
  formats::Output output(run.output(), run.output_options(false));
  const formats::StiffnessStore store(path);
  std::string text =
      "store " + path + "\nbytes " + std::to_string(std::filesystem::file_size(path)) + "\n";
  if (const formats::StoreShard shard = store.shard(); shard.count > 1)
    text += "shard " + std::to_string(shard.index) + " of " + std::to_string(shard.count) + "\n";
  columns::Verification total;
  for (const formats::StiffnessFacts& facts : all_facts(store)) {
    text += describe(facts, store.sizes(facts));
    if (!verify)
      continue;
    const columns::Verification v = run.timed("verify", [&] {
      return at(path, [&] { return verify_object(store, facts, run.context()); });
    });
    text += describe(v);
    add(total, v);
  }
  if (verify)
    report(run, total);
  output.write(text);
  output.commit();
}

void verify_store(cli::Run& run, const formats::StiffnessStore& store, const std::string& name) {
  columns::Verification total;
  for (const formats::StiffnessFacts& facts : all_facts(store))
    add(total, at(name, [&] { return verify_object(store, facts, run.context()); }));
  report(run, total);
}

void report_kept(cli::Run& run, const formats::StiffnessStoreWriter& writer) {
  const std::string part = run.output() + ".part";
  for (const std::uint32_t node : writer.damaged())
    run.warn(part + ": the columns of node " + std::to_string(node) +
             " are damaged: their checksum does not hold; they are computed again");
  if (writer.kept() > 0)
    run.say(part + ": the columns of " + std::to_string(writer.kept()) + " nodes are taken up");
}

void report_store(cli::Run& run, const std::string& path, const StoreTotals& totals,
                  const formats::StiffnessStoreWriter& writer) {
  cli::Stats& stats = run.stats();
  stats.set("objects", totals.objects);
  stats.set("nodes", totals.nodes);
  stats.set("free_axes", totals.order);
  stats.set("matrix_nonzeros", totals.matrix);
  stats.set("factor_nonzeros", totals.factor);
  stats.set("norm", totals.norm);
  stats.set("condition", totals.condition);
  stats.set("residual", totals.residual);
  stats.set("columns", totals.columns);
  stats.set("kept_columns", 3 * writer.kept());
  stats.set("bytes", std::uint64_t{std::filesystem::file_size(path)});
  stats.set("matrix_digest", digest_text(writer.matrix_digest()));
  stats.set("digest", digest_text(writer.digest()));
}

} // namespace gewebe::cli
