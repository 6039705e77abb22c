#pragma once
// The options of ffe-precompute.

#include "formats/store/stiffness_store.h"
#include "model/selector.h"
#include "tools/cli/cli.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gewebe::cli {

struct StoreArguments {
  std::vector<std::string> inputs; ///< models; the store for --info, shards for --merge
  std::string columns = "none", precision = "float64", method = "direct", shard_text;
  std::string rows;           ///< "surface", "all"; empty: "surface" where there are tetrahedra
  std::string update, before; ///< the store of the model before a cut, and that model
  std::optional<double> force, threshold;
  std::optional<double> compress; ///< bound of compressed columns
  std::optional<std::int64_t> steps;
  std::int64_t stage = 1, jobs = 1;
  bool info = false, verify = false, merge = false;
  std::optional<model::Selector> touched;
  formats::StoreShard shard{};
};

/// Declares the options of a program, with their values in `a`.
void declare(cli::Program& p, StoreArguments& a);

/// Checks them against each other and reads their texts. \throw UsageError
void complete(StoreArguments& a);

} // namespace gewebe::cli
