#pragma once
// ffe-precompute: what stores hold into another store.

#include "formats/store/stiffness_store_writer.h"
#include "tools/store/store_info.h"

#include <string>
#include <vector>

namespace gewebe::cli {

/// Copies one object of a store, but no second stage. \throw Error if it is damaged
void copy_object(const formats::StiffnessStore& store, const std::string& group,
                 formats::StiffnessStoreWriter& writer, StoreTotals& totals);

/// Copies all objects of a store, but no second stage. \throw Error if it is damaged
void copy_store(const formats::StiffnessStore& store, formats::StiffnessStoreWriter& writer,
                StoreTotals& totals);

/// Joins the parts 1 to N of a store.
/// \throw Error naming the file if a part is missing, or of another model or made otherwise
void merge_stores(const std::vector<std::string>& paths, formats::StiffnessStoreWriter& writer,
                  StoreTotals& totals);

} // namespace gewebe::cli
