#pragma once
// ffe-precompute: models, or parts of stores, into a store.

#include "formats/store/stiffness_store_writer.h"
#include "tools/shared/cli.h"
#include "tools/store/store_arguments.h"
#include "tools/store/store_info.h"

namespace gewebe {

/// Every model becomes an object, of which the arguments' shard takes its part. `store` is the one
/// whose objects they are second stages of, or null.
/// \throw Error naming the model and what is wrong
void add_models(cli::Run& run, const StoreArguments& a, const StiffnessStore* store,
                StiffnessStoreWriter& writer, StoreTotals& totals);

/// Counts an object that was written.
void add(StoreTotals& totals, const StiffnessFacts& facts, const StiffnessMatrix& matrix,
         const Factor& factor, std::size_t nodes, double residual);

/// Copies one object of a store, but no second stage. \throw Error if it is damaged
void copy_object(const StiffnessStore& store, const std::string& group,
                 StiffnessStoreWriter& writer, StoreTotals& totals);

/// Copies all objects of a store, but no second stage. \throw Error if it is damaged
void copy_store(const StiffnessStore& store, StiffnessStoreWriter& writer, StoreTotals& totals);

/// Joins the parts 1 to N of a store.
/// \throw Error naming the file if a part is missing, or of another model or made otherwise
void merge_stores(const std::vector<std::string>& paths, StiffnessStoreWriter& writer,
                  StoreTotals& totals);

} // namespace gewebe
