#pragma once
// ffe-precompute --info, --verify and --stats.

#include "formats/store/stiffness_store.h"
#include "formats/store/stiffness_store_writer.h"
#include "tools/cli/cli.h"

#include <cstdint>
#include <string>

namespace gewebe::cli {

/// Writes what a store holds as lines "key value" to the run's output; with `verify`, reads all of
/// it, compares the checksums and recomputes columns.
/// \throw Error naming the store and what is wrong with it
void print_store(cli::Run& run, const std::string& path, bool verify);

/// Reads every object of a store back and recomputes the columns of some nodes, for --stats.
/// \throw Error, place = `name`
void verify_store(cli::Run& run, const formats::StiffnessStore& store, const std::string& name);

/// Reports what is kept of an earlier run for the object just begun, and warns of damage.
void report_kept(cli::Run& run, const formats::StiffnessStoreWriter& writer);

/// Sums over the objects of a store that was made, and the worst of each.
struct StoreTotals {
  std::uint64_t objects = 0, nodes = 0, order = 0, matrix = 0, factor = 0, columns = 0;
  double norm = 0, condition = 0, residual = 0;
};

/// Figures of --stats for a finished store at `path`.
void report_store(cli::Run& run, const std::string& path, const StoreTotals& totals,
                  const formats::StiffnessStoreWriter& writer);

} // namespace gewebe::cli
