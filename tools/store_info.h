#pragma once
// ffe-precompute --info and --verify.

#include "formats/stiffness_store.h"
#include "tools/cli.h"

#include <string>

namespace gewebe {

/// Writes what a store holds as lines "key value" to the run's output; with `verify`, reads all of
/// it, compares the checksums and recomputes columns.
/// \throw Error naming the store and what is wrong with it
void print_store(cli::Run& run, const std::string& path, bool verify);

/// Reads every object of a store back and recomputes the columns of some nodes, which --stats
/// tells. \throw Error, place = `name`
void verify_store(cli::Run& run, const StiffnessStore& store, const std::string& name);

} // namespace gewebe
