#pragma once
// ffe-precompute: models into a store.

#include "formats/store/stiffness_store_writer.h"
#include "tools/cli/cli.h"
#include "tools/store/store_arguments.h"
#include "tools/store/store_info.h"

namespace gewebe::cli {

/// Every model becomes an object; a shard computes its part of it. `store` is the one
/// whose objects they are second stages of, or null.
/// \throw Error naming the model and what is wrong
void add_models(cli::Run& run, const StoreArguments& a, const formats::StiffnessStore* store,
                formats::StiffnessStoreWriter& writer, StoreTotals& totals);

/// Counts an object that was written.
void add(StoreTotals& totals, const formats::StiffnessFacts& facts,
         const linalg::StiffnessMatrix& matrix, const linalg::Factor& factor, std::size_t nodes,
         double residual);

} // namespace gewebe::cli
