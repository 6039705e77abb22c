#pragma once
// ffe-precompute --update: the store of a cut model from that of the model before.

#include "formats/store/stiffness_store_writer.h"
#include "tools/cli/cli.h"
#include "tools/store/store_arguments.h"
#include "tools/store/store_info.h"

namespace gewebe::cli {

/// The object of the model before becomes that of the cut model, with columns of the same nodes and
/// of their copies; other objects are copied.
/// \throw Error naming the file: the store holds no such object, is a part, or has a second stage
/// of it; the model isn't cut from the one before; a column isn't as exact as it should be
void update_store(cli::Run& run, const StoreArguments& a, const formats::StiffnessStore& store,
                  formats::StiffnessStoreWriter& writer, StoreTotals& totals);

} // namespace gewebe::cli
